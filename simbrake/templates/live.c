/* A scene for the script of a page: flat memory, numbers in, and metrics, events and curves out. */
#include "scene.c"
#define OUT(type, name) __attribute__((export_name(#name))) type name

static scene_memory memory;
static scene_result result;
static scene_event events[1000];
static double numbers[SCENE_NUMBERS], times[1000], columns[ROWS][SCENE_COLUMNS];
static int names[1000];

OUT(double *, live_numbers)(void) {
  if (numbers[0] == 0) memcpy(numbers, scene_numbers, sizeof numbers);
  return numbers;
}
OUT(double *, live_metrics)(void) { return result.metrics; }
OUT(double *, live_times)(void) { return times; }
OUT(int *, live_names)(void) { return names; }
OUT(double *, live_columns)(void) { return columns[0]; }
OUT(int, live_events)(void) { return result.events_found < 1000 ? result.events_found : 1000; }
OUT(int, live_status)(void) { return result.status; }
OUT(int, live_reason)(void) { return result.reason; }
OUT(int, live_colour)(void) { return result.colour; }
OUT(double, live_reserve)(void) { return result.reserve; }
OUT(double, live_sliding)(void) { return result.sliding; }
OUT(double, live_pull)(void) { return result.pull; }
OUT(int, live_rows)(void) { return result.rows_found < ROWS ? result.rows_found : ROWS; }

/* The whole run; its code. Its columns at the ends of steps, where `rows`. */
OUT(int, live_run)(double rtol, int rows) {
  int code;
  result.events = events;
  result.most_events = 1000;
  result.columns = rows ? columns[0] : NULL;
  result.most_rows = ROWS;
  code = scene_run(&memory, numbers, rtol, &result);
  for (int i = 0; i < live_events(); i++) { times[i] = events[i].time; names[i] = events[i].name; }
  return code;
}

#ifdef STEPS
static double grid[ROWS];
OUT(double *, live_grid)(void) { return grid; }

/* Columns at the first `count` times of the grid, the first of which is the start; how many rows there are. */
OUT(int, live_curves)(double rtol, int count) {
  static scene_stepper stepper;
  if (scene_start(&memory, numbers, rtol, &stepper)) return 0;
  for (int i = 0; i < count; i++) {
    if (grid[i] > stepper.time && scene_step(&memory, &stepper, grid[i] - stepper.time, NULL, NULL, 0, NULL)) return i;
    memcpy(columns[i], stepper.columns, sizeof columns[i]);
  }
  return count;
}
#endif
