/* @name@: @kind@, as C99 by simbrake @version@, from the scene given to it.

   All in SI units. Compile with -std=c99 -ffp-contract=off and link with the mathematical library (-lm).
   With SCENE_DECLARATIONS defined before it is included, this file gives declarations alone@heading_of_main@. */
#ifndef SCENE_H
#define SCENE_H
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
//% for what, entries in enums.items()
enum scene_@what@ {
//% for key, number, meaning in entries
  SCENE_@key@ = @number@, /* @meaning@ */
//% endfor
};
//% endfor
@""@
typedef struct { double time; int name; } scene_event; /* name: an scene_event_name */

//% if runs
typedef struct {
  double metrics[@metrics|length or 1@];
  int accepted, rejected, retaken, changes, segments; /* steps; events and segments of the integration */
  scene_event *events; int most_events, events_found; /* space of the caller, or NULL; all that there were */
  double *columns; int most_rows, rows_found; /* rows of SCENE_COLUMNS numbers, or NULL: no rows are made */
  int status; /* an scene_status, how a run ended that reached its end */
  int reason, colour; /* an scene_reason: whether the brake did what it was to do; 0 green, 1 amber, 2 red */
  double reserve, sliding; /* static and sliding torque over that of the hanging load, infinite without one */
  double pull; /* N, greatest of the duty */
} scene_result;

//% endif
//% if steps
typedef struct { double times[@points|max@], values[@points|max@]; int passed; double lag; } scene_held;

/* A brake between two steps: plain numbers, which may be copied, kept and set back. */
typedef struct {
  double start, time, rtol;
  double numbers[@count@], y[@ny@], columns[@width@];
  int32_t mode[@nm@];
  int begun, holding; /* holding: the pulley is at rest */
  scene_held held[@held or 1@];
} scene_stepper;

//% endif
typedef struct scene_memory scene_memory; /* working memory of one thread */
scene_memory *scene_new(void); /* NULL where there is none */
void scene_free(scene_memory *memory);

extern const double scene_numbers[SCENE_NUMBERS]; /* those of the scene */
extern const char *const scene_event_names[], *const scene_code_names[];

//% if runs
extern const char *const scene_metric_names[], *const scene_status_names[], *const scene_reason_names[];
/* The whole run with these numbers; an scene_code. `result` names the space for events and columns. */
int scene_run(scene_memory *memory, const double *numbers, double rtol, scene_result *result);
//% endif
//% if steps
/* A stepper at the start, under the scene's own inputs. */
int scene_start(scene_memory *memory, const double *numbers, double rtol, scene_stepper *stepper);
/* Advances by `dt` under inputs that are held from now on; on any other code than 0 the stepper stays as it was. */
int scene_step(scene_memory *memory, scene_stepper *stepper, double dt, const double *inputs,
    scene_event *events, int most_events, int *events_found);
//% endif
#ifdef __cplusplus
}
#endif
#endif

#ifndef SCENE_DECLARATIONS
@helpers@
@programs.values()|map(attribute="text")|join@
struct scene_memory {
//% for key, program in programs.items()
  struct @program.name@_frame @key@;
//% endfor
  @room@
};

const double scene_numbers[SCENE_NUMBERS] = {@values@};
const char *const scene_event_names[] = {@strings(event_names)@};
const char *const scene_code_names[] = {@strings(code_names)@};

scene_memory *scene_new(void) { return (scene_memory *)calloc(1, sizeof(scene_memory)); }
void scene_free(scene_memory *memory) { free(memory); }

static const unsigned short scene_sequences[][@longest@] = {@sequences@};
static const unsigned short scene_changes[] = {
@changes@
};
static const unsigned char scene_endings[] = {
@endings@
};
static const unsigned char scene_resting[] = {@resting@};
static int scene_place(const int32_t *l) { return @place@; }
static int scene_rests(const int32_t *l) { return scene_resting[scene_place(l)]; }
/* Appends the events of a change of mode; how many there are then. */
static int scene_append(scene_event *events, int room, int count, double time, const int32_t *l, int first) {
  const int32_t *m = l + 5;
  const unsigned short *sequence;
  if (memcmp(l, m, 5 * sizeof *l) == 0) return count;
  sequence = scene_sequences[scene_changes[
    ((scene_place(l) * @states@ + scene_place(m)) * 2 + (l[3] != m[3])) * 2 + first]];
  for (; *sequence; sequence++, count++)
    if (count < room) { events[count].time = time; events[count].name = *sequence; }
  return count;
}

static int scene_sound(const double *x, int count, double rtol) {
  static const struct { int first, size; double low, high; } ranges[] = {@ranges@};
  if (!(rtol > 1e-15 && rtol < 0.1)) return 0;
  for (int i = 0; i < count; i++) if (x[i] != x[i]) return 0;
  for (size_t k = 0; k < sizeof ranges / sizeof *ranges; k++)
    for (int i = 0; i < ranges[k].size; i++) {
      const double number = x[ranges[k].first + i];
      if (number < ranges[k].low || number > ranges[k].high) return 0;
    }
  return 1;
}

//% if runs
const char *const scene_metric_names[] = {@strings(metrics or [""])@};
const char *const scene_status_names[] = {@strings(statuses)@};
const char *const scene_reason_names[] = {@strings(reasons)@};

int scene_run(scene_memory *memory, const double *numbers, double rtol, scene_result *result) {
  int events = 0, rows = 0;
  if (memory == NULL) return SCENE_CODE_NO_MEMORY;
  if (!scene_sound(numbers, @count@, rtol)) return SCENE_CODE_BAD_NUMBER;
  memcpy(memory->whole_in, numbers, @count@ * sizeof *numbers);
  memory->whole_in[@count@] = rtol;
  @give("whole", 0, "memory->whole_in")@
  scene_whole_main(&memory->whole);
  const int32_t *counts = @whole(1)@;
  const int count = counts[1];
//% if metrics|length > 1
  memcpy(result->metrics, @whole(0)@, sizeof result->metrics);
//% elif metrics
  result->metrics[0] = @whole(0)@;
//% endif
  result->accepted = counts[2]; result->rejected = counts[3]; result->retaken = counts[4];
  result->changes = counts[5]; result->segments = counts[6];
  const double *t = @whole(2)@;
  for (int i = 0, first = 1; i < count; i++) {
    const int32_t *label = @whole(6)@ + 5 * i;
    if (memcmp(label, label + 5, 5 * sizeof *label) == 0) continue;
    events = scene_append(result->events, result->events ? result->most_events : 0, events, t[i + 1], label,
        first && t[i + 1] == t[0]);
    first = 0;
  }
  result->events_found = events;
  for (int i = 0; i <= count && result->columns; i++) {
    if (i < count && @whole(5)@[i] == @skipped@) continue;
    if (rows < result->most_rows) {
      @give("seen", 0, "memory->whole_in")@
      @give("seen", 1, "t + i")@
      @give("seen", 2, whole(3) ~ " + " ~ run_ny ~ " * i")@
      @give("seen", 3, whole(4) ~ " + " ~ run_nm ~ " * i")@
      scene_seen_main(&memory->seen);
      memcpy(result->columns + @width@ * (size_t)rows, @seen(0)@, @width@ * sizeof(double));
    }
    rows++;
  }
  result->rows_found = rows;
  const int32_t *flags = @whole(7)@;
  result->status = scene_endings[scene_place(@whole(6)@ + 5 * count) * 16
    + flags[0] * 8 + flags[1] * 4 + flags[2] * 2 + flags[3]];
  result->reason = flags[4];
  result->colour = flags[5];
  result->reserve = @whole(8)@[0];
  result->sliding = @whole(8)@[1];
  result->pull = @whole(8)@[2];
  return counts[0];
}

#ifdef SCENE_MAIN
#include <stdio.h>
int main(void) {
  static scene_event events[1000];
  scene_result result = {{0}};
  scene_memory *memory = scene_new();
  int code;
  result.events = events;
  result.most_events = 1000;
  code = scene_run(memory, scene_numbers, @rtol@, &result);
  for (int i = 0; i < @metrics|length@; i++) printf("%s = %.17g\n", scene_metric_names[i], result.metrics[i]);
  for (int i = 0; i < result.events_found && i < 1000; i++)
    printf("%.17g s  %s\n", events[i].time, scene_event_names[events[i].name]);
  if (code) fprintf(stderr, "%s\n", code > 0 ? scene_code_names[code] : "no memory");
  scene_free(memory);
  return code != 0;
}
#endif
//% endif
//% if steps
static int scene_integrate(scene_memory *memory, scene_stepper *s, double end, scene_event *events, int room,
    int *found) {
  static const int points[] = {@points|join(", ")@};
  static const int places[] = {@places@};
  double *x = memory->part_in, t0 = s->time;
  do {
    int n = @count@;
    memcpy(x, s->numbers, @count@ * sizeof *x);
    x[n] = s->rtol; x[n + 1] = INFINITY; x[n + 2] = 10000; n += 3;
    for (int k = 0; k < @held@; k++) {
      memcpy(x + n, s->held[k].times, points[k] * sizeof *x); n += points[k];
      memcpy(x + n, s->held[k].values, points[k] * sizeof *x); n += points[k];
      if (s->y[0] == s->y[0]) s->mode[places[k]] = s->held[k].passed;
    }
    x[n] = s->time; x[n + 1] = end; n += 2;
    memcpy(x + n, s->y, sizeof s->y); n += @ny@;
    for (int i = 0; i < @nm@; i++) x[n + i] = s->mode[i];
    @give("part", 0, "x")@
    scene_part_main(&memory->part);
    const int code = @part(0)@[0], count = @part(0)@[1];
    const double *t = @part(1)@;
    if (code != SCENE_CODE_COMPLETED && code != SCENE_CODE_STEP_LIMIT) return code;
    for (int i = 0, first = !s->begun && s->time == t0; i < count; i++) {
      const int32_t *label = @part(2)@ + 5 * i;
      if (memcmp(label, label + 5, 5 * sizeof *label) == 0) continue;
      *found = scene_append(events, events ? room : 0, *found, t[i + 1], label, first && t[i + 1] == t[0]);
      first = 0;
    }
    s->time = t[count];
    s->holding = scene_rests(@part(2)@ + 5 * count);
    memcpy(s->y, @part(3)@, sizeof s->y);
    memcpy(s->mode, @part(4)@, sizeof s->mode);
    memcpy(s->columns, @part(5)@, sizeof s->columns);
    for (int k = 0; k < @held@; k++) s->held[k].passed = s->mode[places[k]];
  } while (s->time < end);
  return SCENE_CODE_COMPLETED;
}

int scene_start(scene_memory *memory, const double *numbers, double rtol, scene_stepper *stepper) {
  static const int points[] = {@points|join(", ")@};
  scene_stepper s = {0};
  int found = 0, code;
  if (memory == NULL) return SCENE_CODE_NO_MEMORY;
  if (!scene_sound(numbers, @count@, rtol)) return SCENE_CODE_BAD_NUMBER;
  memcpy(s.numbers, numbers, sizeof s.numbers);
  @give("begun", 0, "s.numbers")@
  scene_begun_main(&memory->begun);
  s.start = s.time = @begun(0)@@"[0]" if held else ""@;
  s.rtol = rtol;
  for (int k = 0; k < @held@; k++) {
    const double *about = @begun(0) ~ " + 1 + 3 * k" if held else "&s.time"@;
    for (int i = 0; i < points[k]; i++) { s.held[k].values[i] = about[0]; s.held[k].times[i] = about[1]; }
    s.held[k].lag = about[2];
  }
  s.y[0] = NAN;
  code = scene_integrate(memory, &s, s.time, NULL, 0, &found);
  for (int k = 0; k < @held@; k++) s.held[k].passed = points[k];
  if (code == SCENE_CODE_COMPLETED) *stepper = s;
  return code;
}

int scene_step(scene_memory *memory, scene_stepper *stepper, double dt, const double *inputs,
    scene_event *events, int most_events, int *events_found) {
  static const int points[] = {@points|join(", ")@}, least[] = {@least@};
  static const int positive[] = {@positive@}, prompt[] = {@prompt@};
  scene_stepper s = *stepper;
  int found = 0, code;
  if (memory == NULL) return SCENE_CODE_NO_MEMORY;
  if (!(dt >= 0 && dt < INFINITY)) return SCENE_CODE_BAD_NUMBER;
  for (int k = 0; k < @held@; k++) {
    scene_held *h = &s.held[k];
    double *t = h->times, *v = h->values;
    const int n = points[k];
    if (!isfinite(inputs[k]) || (positive[k] && inputs[k] < 0)) return SCENE_CODE_BAD_NUMBER;
    if (inputs[k] == v[n - 1]) continue;
    if (s.time == s.start && prompt[k]) { /* it is what the run begins with */
      for (int i = 0; i < n; i++) v[i] = inputs[k];
      continue;
    }
    if (h->passed < n && t[n - 1] == s.time) { /* it takes the place of one that has not acted yet */
      v[n - 1] = inputs[k];
      continue;
    }
    if (h->passed < least[k]) return SCENE_CODE_TOO_MANY_COMMANDS;
    if (h->lag > 0) v[2] -= (v[1] - v[0]) * exp(-(t[2] - t[0]) / h->lag); /* what is left of a jump that is over */
    memmove(t, t + 2, (n - 2) * sizeof *t);
    memmove(v, v + 2, (n - 2) * sizeof *v);
    t[n - 2] = t[n - 1] = s.time;
    v[n - 2] = n > 2 ? v[n - 3] : stepper->held[k].values[n - 1];
    v[n - 1] = inputs[k];
    h->passed -= 2;
  }
  code = scene_integrate(memory, &s, s.time + dt, events, most_events, &found);
  if (code != SCENE_CODE_COMPLETED) return code;
  s.begun = s.begun || dt > 0;
  if (events_found) *events_found = found;
  *stepper = s;
  return code;
}

//% endif
#endif
