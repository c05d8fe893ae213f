/* A stepper of a scene behind the functions of FMI 2.0 or 3.0, co-simulation. Included are the scene's own file and
   variables.h beside it: NAME(x) and UPPER(x) are the names of the scene's file, `variables` are in the order of their
   value references. Values of inputs are held from the next step on; outputs are those at the end of the last step. A
   step that fails leaves the state as it was, with the reason in the log. */
#include <stdarg.h>
#include <stdio.h>

enum kind { PARAMETER, TOLERANCE, INPUT, COLUMN, HOLDING, EVENT_COUNT, LAST_EVENT, LAST_EVENT_TIME, TIME };
/* first: place of a number, an input or a column, of which `size` are there and the largest is given */
typedef struct { int kind, first, size; double low, high; const char *name, *unit; } variable;
#include "variables.h"

#define COUNT ((int)(sizeof variables / sizeof *variables))
#define MOST_EVENTS 1000
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } status; /* as in FMI 2.0 and 3.0 */

/* What is kept of an instance as its state. */
typedef struct {
  double numbers[UPPER(NUMBERS)], rtol, inputs[UPPER(INPUTS) + 1], last_event_time;
  double start, offset; /* of the simulation; its time less that of the scene */
  int running; /* after initialization */
  int started, event_count, last_event;
  NAME(stepper) stepper;
} state;

typedef struct instance {
  state now;
  NAME(memory) *memory;
  NAME(event) events[MOST_EVENTS];
  double failed_at, failed_size; /* of the step that was discarded */
  int logging;
  void (*log)(struct instance *, status, const char *category, const char *text);
  void (*logger)(void); /* of the environment */
  void *environment;
  char name[];
} instance;

static status said(instance *one, status code, const char *category, const char *format, ...) {
  char text[500];
  va_list values;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  if (one->logging || code > WARNING) one->log(one, code, category, text);
  return code;
}

static instance *made(const char *name, const char *token, int logging, void *environment, void (*logger)(void),
    void (*log)(instance *, status, const char *, const char *)) {
  instance *one = (instance *)calloc(1, sizeof *one + strlen(name) + 1);
  if (one == NULL) return NULL;
  strcpy(one->name, name);
  one->logging = logging; one->environment = environment; one->logger = logger; one->log = log;
  one->failed_at = NAN;
  if (token == NULL || strcmp(token, TOKEN) != 0) {
    said(one, ERROR, "logStatusError", "the identifier is not that of this FMU: %s", token ? token : "none");
    free(one);
    return NULL;
  }
  if ((one->memory = NAME(new)()) == NULL) {
    said(one, ERROR, "logStatusError", "there is no memory");
    free(one);
    return NULL;
  }
  return one;
}

static void freed(instance *one) {
  if (one) NAME(free)(one->memory);
  free(one);
}

/* Numbers, inputs and clock as at first. */
static void reset(instance *one) {
  state first;
  memset(&first, 0, sizeof first); /* padding too: equal states are equal bytes */
  memcpy(first.numbers, NAME(numbers), sizeof first.numbers);
  first.rtol = RTOL;
  for (int i = 0; i < UPPER(INPUTS); i++) first.inputs[i] = input_starts[i];
  first.last_event_time = -1;
  one->now = first;
}

static const char *reason(int code) {
  if (code == UPPER(CODE_BAD_NUMBER)) return "a number, a time or an input is not finite, or out of range";
  if (code == UPPER(CODE_NO_MEMORY)) return "there is no memory";
  if (code == UPPER(CODE_TOO_MANY_COMMANDS)) return "more commands wait in the dead time than there is space for; write the FMU with a larger waiting";
  return NAME(code_names)[code];
}

static status out_of_range(instance *one, const variable *v, double x) {
  return said(one, ERROR, "logStatusError", "%s: %.15g%s is out of range, %.15g to %.15g%s", v->name, x, v->unit, v->low,
      v->high, v->unit);
}

/* The brake at the start of the scene, with the parameters that were set. */
static status started(instance *one) {
  state *now = &one->now;
  int code;
  if (now->started) return OK;
  for (int i = 0; i < COUNT; i++) {
    const variable *v = &variables[i];
    double x = v->kind == PARAMETER ? now->numbers[v->first] : now->rtol;
    if (v->kind > TOLERANCE || (x >= v->low && x <= v->high)) continue;
    return out_of_range(one, v, x);
  }
  code = NAME(start)(one->memory, now->numbers, now->rtol, &now->stepper);
  if (code) return said(one, ERROR, "logStatusError", "the brake cannot start: %s", reason(code));
  now->offset = now->start - now->stepper.time;
  now->started = 1;
  return OK;
}

static status read(instance *one, unsigned reference, double *value) {
  const state *now = &one->now;
  const variable *v = variables + (reference < (unsigned)COUNT ? reference : 0);
  if (reference >= (unsigned)COUNT)
    return said(one, ERROR, "logStatusError", "there is no variable with the value reference %u", reference);
  if (v->kind >= COLUMN && v->kind != EVENT_COUNT) {
    const status code = started(one);
    if (code) return code;
  }
  switch (v->kind) {
    case PARAMETER: *value = now->numbers[v->first]; break;
    case TOLERANCE: *value = now->rtol; break;
    case INPUT: *value = now->inputs[v->first]; break;
    case COLUMN:
      *value = now->stepper.columns[v->first];
      for (int i = 1; i < v->size; i++)
        if (now->stepper.columns[v->first + i] > *value) *value = now->stepper.columns[v->first + i];
      break;
    case HOLDING: *value = now->stepper.holding; break;
    case EVENT_COUNT: *value = now->event_count; break;
    case LAST_EVENT: *value = now->last_event; break;
    case LAST_EVENT_TIME: *value = now->last_event_time; break;
    default: *value = now->stepper.time + now->offset;
  }
  return OK;
}

static status write(instance *one, unsigned reference, double value) {
  state *now = &one->now;
  const variable *v = variables + (reference < (unsigned)COUNT ? reference : 0);
  if (reference >= (unsigned)COUNT)
    return said(one, ERROR, "logStatusError", "there is no variable with the value reference %u", reference);
  if (v->kind == INPUT) {
    now->inputs[v->first] = value;
    return OK;
  }
  if (v->kind > TOLERANCE) return said(one, ERROR, "logStatusError", "%s is an output", v->name);
  if (one->now.running) return said(one, ERROR, "logStatusError", "%s is fixed once initialized", v->name);
  *(v->kind == PARAMETER ? &now->numbers[v->first] : &now->rtol) = value;
  now->started = 0;
  return OK;
}

static status step(instance *one, double time, double dt) {
  state *now = &one->now;
  const double clock = now->stepper.time + now->offset, off = time - clock, size = clock < 0 ? -clock : clock;
  int found = 0, code;
  if (!(off <= 1e-9 * (1 + size) && off >= -1e-9 * (1 + size)))
    return said(one, ERROR, "logStatusError", "the step begins at %.17g s, the brake is at %.17g s", time, clock);
  if (!(dt >= 0 && dt < INFINITY))
    return said(one, ERROR, "logStatusError", "a step of %.15g s is out of range, 0 s or more", dt);
  for (int i = 0; i < COUNT; i++) {
    const variable *v = &variables[i];
    const double x = v->kind == INPUT ? now->inputs[v->first] : 0;
    if (v->kind == INPUT && !(x >= v->low && x <= v->high)) return out_of_range(one, v, x);
  }
  code = NAME(step)(one->memory, &now->stepper, dt, now->inputs, one->events, MOST_EVENTS, &found);
  if (code) {
    /* A shorter step has fewer events. One as long fails again, which some environments try for ever. */
    const int again = time == one->failed_at && dt >= one->failed_size;
    const int shorter_helps = code == UPPER(CODE_EVENT_LIMIT) && !again;
    const char *category = shorter_helps ? "logStatusDiscard" : "logStatusError";
    one->failed_at = time;
    one->failed_size = dt;
    return said(one, shorter_helps ? DISCARD : ERROR, category, "the step of %.15g s failed: %s", dt, reason(code));
  }
  for (int i = 0; i < found && i < MOST_EVENTS; i++) {
    now->last_event = one->events[i].name;
    now->last_event_time = one->events[i].time + now->offset;
    said(one, OK, "logEvents", "%.17g s  %s", now->last_event_time, NAME(event_names)[now->last_event]);
  }
  now->event_count += found;
  return OK;
}

/* A state as bytes: the token tells to which FMU it belongs. */
typedef struct { char token[sizeof TOKEN]; state now; } kept;

static status state_taken(instance *one, void **place) {
  kept *copy = (kept *)(*place ? *place : calloc(1, sizeof *copy));
  if (copy == NULL) return said(one, ERROR, "logStatusError", "there is no memory");
  memcpy(copy->token, TOKEN, sizeof TOKEN);
  copy->now = one->now;
  *place = copy;
  return OK;
}

static status state_set_back(instance *one, const void *place) {
  one->now = ((const kept *)place)->now;
  return OK;
}

static status state_from_bytes(instance *one, const void *bytes, size_t size, void **place) {
  kept *copy;
  if (size != sizeof *copy || memcmp(bytes, TOKEN, sizeof TOKEN) != 0)
    return said(one, ERROR, "logStatusError", "the bytes are no state of this FMU");
  if ((copy = (kept *)malloc(sizeof *copy)) == NULL)
    return said(one, ERROR, "logStatusError", "there is no memory");
  memcpy(copy, bytes, sizeof *copy);
  *place = copy;
  return OK;
}

static status state_to_bytes(instance *one, const void *place, size_t size, void *bytes) {
  if (size < sizeof(kept)) return said(one, ERROR, "logStatusError", "the space is too small for a state");
  memcpy(bytes, place, sizeof(kept));
  return OK;
}

static status each_read(instance *one, const unsigned *references, size_t count, double *values) {
  status code = OK;
  for (size_t i = 0; i < count && code == OK; i++) code = read(one, references[i], &values[i]);
  return code;
}

static status each_written(instance *one, const unsigned *references, size_t count, const double *values) {
  status code = OK;
  for (size_t i = 0; i < count && code == OK; i++) code = write(one, references[i], values[i]);
  return code;
}

#define GET(type, places, count, values)                                                       \
  for (size_t i = 0; i < (count); i++) {                                                       \
    double x;                                                                                  \
    const status code = read((instance *)one, (places)[i], &x);                                \
    if (code) return code;                                                                     \
    (values)[i] = (type)x;                                                                     \
  }                                                                                            \
  return OK
#define NONE(one, what) return said((instance *)(one), ERROR, "logStatusError", "this FMU has no %s", what)

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif
#define JOINED(a, b) a##b
#define AFTER(a, b) JOINED(a, b)
#if FMI_VERSION == 2
#define PREFIX fmi2
#else
#define PREFIX fmi3
#endif
#if defined FMI2_FUNCTION_PREFIX /* of an environment that links several FMUs statically */
#define FMI(result, name) EXPORT result AFTER(FMI2_FUNCTION_PREFIX, AFTER(PREFIX, name))
#elif defined FMI3_FUNCTION_PREFIX
#define FMI(result, name) EXPORT result AFTER(FMI3_FUNCTION_PREFIX, AFTER(PREFIX, name))
#else
#define FMI(result, name) EXPORT result AFTER(PREFIX, name)
#endif

/* The same in both versions. */
FMI(void, FreeInstance)(void *one) { freed((instance *)one); }
FMI(status, ExitInitializationMode)(void *one) {
  const status code = started((instance *)one);
  ((instance *)one)->now.running = code == OK;
  return code;
}
FMI(status, Terminate)(void *one) { (void)one; return OK; }
FMI(status, Reset)(void *one) { reset((instance *)one); return OK; }

#if FMI_VERSION == 2
/* FMI 2.0.4 */
typedef struct {
  void (*logger)(void *, const char *, int, const char *, const char *, ...);
  void *(*allocate)(size_t, size_t);
  void (*free)(void *);
  void (*finished)(void *, int);
  void *environment;
} callbacks;

static void told(instance *one, status code, const char *category, const char *text) {
  void (*logger)(void *, const char *, int, const char *, const char *, ...) =
      (void (*)(void *, const char *, int, const char *, const char *, ...))one->logger;
  char plain[1000]; /* as a format: not every environment knows of arguments */
  int n = 0;
  for (; *text && n < (int)sizeof plain - 2; text++) {
    if (*text == '%') plain[n++] = '%';
    plain[n++] = *text;
  }
  plain[n] = 0;
  if (logger) logger(one->environment, one->name, code, category, plain);
}

FMI(const char *, GetTypesPlatform)(void) { return "default"; }
FMI(const char *, GetVersion)(void) { return "2.0"; }
FMI(status, SetDebugLogging)(void *one, int on, size_t count, const char *const *categories) {
  (void)count; (void)categories;
  ((instance *)one)->logging = on;
  return OK;
}
FMI(void *, Instantiate)(const char *name, int type, const char *token, const char *resources,
    const callbacks *functions, int visible, int logging) {
  instance *one = made(name ? name : "", token, logging, functions ? functions->environment : NULL,
      functions ? (void (*)(void))functions->logger : NULL, told);
  (void)resources; (void)visible;
  if (one && type != 1) {
    said(one, ERROR, "logStatusError", "this FMU is for co-simulation alone");
    freed(one);
    return NULL;
  }
  if (one) reset(one);
  return one;
}
FMI(status, SetupExperiment)(void *one, int tolerant, double tolerance, double start, int ends, double end) {
  (void)tolerant; (void)tolerance; (void)ends; (void)end; /* the tolerance is the parameter rtol */
  ((instance *)one)->now.start = start;
  ((instance *)one)->now.started = 0;
  return OK;
}
FMI(status, EnterInitializationMode)(void *one) { (void)one; return OK; }
FMI(status, GetReal)(void *one, const unsigned *places, size_t count, double *values) {
  return each_read((instance *)one, places, count, values);
}
FMI(status, GetInteger)(void *one, const unsigned *places, size_t count, int *values) { GET(int, places, count, values); }
FMI(status, GetBoolean)(void *one, const unsigned *places, size_t count, int *values) { GET(int, places, count, values); }
FMI(status, GetString)(void *one, const unsigned *places, size_t count, const char **values) {
  (void)places; (void)values;
  if (count) NONE(one, "texts");
  return OK;
}
FMI(status, SetReal)(void *one, const unsigned *places, size_t count, const double *values) {
  return each_written((instance *)one, places, count, values);
}
FMI(status, SetInteger)(void *one, const unsigned *places, size_t count, const int *values) {
  (void)places; (void)values;
  if (count) NONE(one, "integers that can be set");
  return OK;
}
FMI(status, SetBoolean)(void *one, const unsigned *places, size_t count, const int *values) {
  (void)places; (void)values;
  if (count) NONE(one, "booleans that can be set");
  return OK;
}
FMI(status, SetString)(void *one, const unsigned *places, size_t count, const char *const *values) {
  (void)places; (void)values;
  if (count) NONE(one, "texts");
  return OK;
}
FMI(status, GetFMUstate)(void *one, void **place) { return state_taken((instance *)one, place); }
FMI(status, SetFMUstate)(void *one, const void *place) { return state_set_back((instance *)one, place); }
FMI(status, FreeFMUstate)(void *one, void **place) {
  (void)one;
  if (place) { free(*place); *place = NULL; }
  return OK;
}
FMI(status, SerializedFMUstateSize)(void *one, const void *place, size_t *size) {
  (void)one; (void)place;
  *size = sizeof(kept);
  return OK;
}
FMI(status, SerializeFMUstate)(void *one, const void *place, char *bytes, size_t size) {
  return state_to_bytes((instance *)one, place, size, bytes);
}
FMI(status, DeSerializeFMUstate)(void *one, const char *bytes, size_t size, void **place) {
  return state_from_bytes((instance *)one, bytes, size, place);
}
FMI(status, GetDirectionalDerivative)(void *one, const unsigned *of, size_t n, const unsigned *by, size_t m,
    const double *seed, double *values) {
  (void)of; (void)n; (void)by; (void)m; (void)seed; (void)values;
  NONE(one, "derivatives");
}
FMI(status, SetRealInputDerivatives)(void *one, const unsigned *places, size_t count, const int *order,
    const double *values) {
  (void)places; (void)count; (void)order; (void)values;
  NONE(one, "derivatives of inputs");
}
FMI(status, GetRealOutputDerivatives)(void *one, const unsigned *places, size_t count, const int *order,
    double *values) {
  (void)places; (void)count; (void)order; (void)values;
  NONE(one, "derivatives of outputs");
}
FMI(status, DoStep)(void *one, double time, double dt, int no_return) {
  (void)no_return;
  return step((instance *)one, time, dt);
}
FMI(status, CancelStep)(void *one) { NONE(one, "steps that go on by themselves"); }
FMI(status, GetStatus)(void *one, int what, status *value) { (void)what; (void)value; NONE(one, "pending steps"); }
FMI(status, GetRealStatus)(void *one, int what, double *value) {
  if (what != 2) NONE(one, "such status"); /* the last time that was reached */
  *value = ((instance *)one)->now.stepper.time + ((instance *)one)->now.offset;
  return OK;
}
FMI(status, GetIntegerStatus)(void *one, int what, int *value) { (void)what; (void)value; NONE(one, "such status"); }
FMI(status, GetBooleanStatus)(void *one, int what, int *value) {
  if (what != 3) NONE(one, "such status");
  *value = 0; /* it never ends a simulation by itself */
  return OK;
}
FMI(status, GetStringStatus)(void *one, int what, const char **value) { (void)what; (void)value; NONE(one, "such status"); }
#else
/* FMI 3.0.2 */
#include <stdbool.h>
#define PLACES const unsigned *places, size_t count

static void told(instance *one, status code, const char *category, const char *text) {
  void (*logger)(void *, status, const char *, const char *) =
      (void (*)(void *, status, const char *, const char *))one->logger;
  if (logger) logger(one->environment, code, category, text);
}

FMI(const char *, GetVersion)(void) { return "3.0"; }
FMI(status, SetDebugLogging)(void *one, bool on, size_t count, const char *const *categories) {
  (void)count; (void)categories;
  ((instance *)one)->logging = on;
  return OK;
}
FMI(void *, InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, bool events, bool early, const unsigned *places, size_t count, void *environment,
    void (*logger)(void *, status, const char *, const char *), void (*update)(void)) {
  instance *one = made(name ? name : "", token, logging, environment, (void (*)(void))logger, told);
  (void)resources; (void)visible; (void)events; (void)early; (void)places; (void)count; (void)update;
  if (one) reset(one);
  return one;
}
FMI(void *, InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, void *environment, void (*logger)(void *, status, const char *, const char *)) {
  (void)name; (void)token; (void)resources; (void)visible; (void)logging;
  if (logger) logger(environment, ERROR, "logStatusError", "this FMU is for co-simulation alone");
  return NULL;
}
FMI(void *, InstantiateScheduledExecution)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, void *environment, void (*logger)(void *, status, const char *, const char *), void (*update)(void),
    void (*lock)(void), void (*unlock)(void)) {
  (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)update; (void)lock; (void)unlock;
  if (logger) logger(environment, ERROR, "logStatusError", "this FMU is for co-simulation alone");
  return NULL;
}
FMI(status, EnterInitializationMode)(void *one, bool tolerant, double tolerance, double start, bool ends, double end) {
  (void)tolerant; (void)tolerance; (void)ends; (void)end; /* the tolerance is the parameter rtol */
  ((instance *)one)->now.start = start;
  ((instance *)one)->now.started = 0;
  return OK;
}
FMI(status, EnterConfigurationMode)(void *one) { (void)one; return OK; }
FMI(status, ExitConfigurationMode)(void *one) { (void)one; return OK; }
FMI(status, EnterStepMode)(void *one) { (void)one; return OK; }
FMI(status, GetFloat64)(void *one, PLACES, double *values, size_t n) {
  (void)n;
  return each_read((instance *)one, places, count, values);
}
FMI(status, GetInt32)(void *one, PLACES, int32_t *values, size_t n) { (void)n; GET(int32_t, places, count, values); }
FMI(status, GetBoolean)(void *one, PLACES, bool *values, size_t n) { (void)n; GET(bool, places, count, values); }
FMI(status, SetFloat64)(void *one, PLACES, const double *values, size_t n) {
  (void)n;
  return each_written((instance *)one, places, count, values);
}
FMI(status, GetNumberOfVariableDependencies)(void *one, unsigned place, size_t *n) {
  (void)place;
  *n = 0;
  NONE(one, "list of dependencies");
}
FMI(status, GetVariableDependencies)(void *one, unsigned place, size_t *of, unsigned *by, size_t *which, int *kinds,
    size_t n) {
  (void)place; (void)of; (void)by; (void)which; (void)kinds; (void)n;
  NONE(one, "list of dependencies");
}
FMI(status, GetFMUState)(void *one, void **place) { return state_taken((instance *)one, place); }
FMI(status, SetFMUState)(void *one, void *place) { return state_set_back((instance *)one, place); }
FMI(status, FreeFMUState)(void *one, void **place) {
  (void)one;
  if (place) { free(*place); *place = NULL; }
  return OK;
}
FMI(status, SerializedFMUStateSize)(void *one, void *place, size_t *size) {
  (void)one; (void)place;
  *size = sizeof(kept);
  return OK;
}
FMI(status, SerializeFMUState)(void *one, void *place, uint8_t *bytes, size_t size) {
  return state_to_bytes((instance *)one, place, size, bytes);
}
FMI(status, DeserializeFMUState)(void *one, const uint8_t *bytes, size_t size, void **place) {
  return state_from_bytes((instance *)one, bytes, size, place);
}
FMI(status, DoStep)(void *one, double time, double dt, bool no_return, bool *events, bool *ends, bool *early,
    double *reached) {
  const status code = step((instance *)one, time, dt);
  (void)no_return;
  *events = *ends = *early = false;
  *reached = ((instance *)one)->now.stepper.time + ((instance *)one)->now.offset;
  return code;
}
FMI(status, UpdateDiscreteStates)(void *one, bool *again, bool *ends, bool *nominals, bool *states, bool *defined,
    double *next) {
  (void)one; (void)next;
  *again = *ends = *nominals = *states = *defined = false;
  return OK;
}

/* What has no meaning here. */
#define NOT(what, name, ...)                  \
  FMI(status, name)(void *one, __VA_ARGS__) { \
    (void)count; (void)values;                \
    if (count) NONE(one, what);               \
    return OK;                                \
  }
#define NO_TYPE(name, type)                                                       \
  NOT("such variables", Get##name, PLACES, type *values, size_t n)                \
  NOT("such variables that can be set", Set##name, PLACES, const type *values, size_t n)
NO_TYPE(Float32, float) NO_TYPE(Int8, int8_t) NO_TYPE(UInt8, uint8_t) NO_TYPE(Int16, int16_t)
NO_TYPE(UInt16, uint16_t) NO_TYPE(UInt32, uint32_t) NO_TYPE(Int64, int64_t) NO_TYPE(UInt64, uint64_t)
NO_TYPE(String, char *const)
NOT("integers that can be set", SetInt32, PLACES, const int32_t *values, size_t n)
NOT("booleans that can be set", SetBoolean, PLACES, const bool *values, size_t n)
NOT("such variables", GetBinary, PLACES, size_t *sizes, const uint8_t **values, size_t n)
NOT("such variables", SetBinary, PLACES, const size_t *sizes, const uint8_t *const *values, size_t n)
NOT("clocks", GetClock, PLACES, bool *values)
NOT("clocks", SetClock, PLACES, const bool *values)
NOT("clocks", GetIntervalDecimal, PLACES, double *values, int *qualifiers)
NOT("clocks", GetIntervalFraction, PLACES, uint64_t *values, uint64_t *resolutions, int *qualifiers)
NOT("clocks", GetShiftDecimal, PLACES, double *values)
NOT("clocks", GetShiftFraction, PLACES, uint64_t *values, uint64_t *resolutions)
NOT("clocks", SetIntervalDecimal, PLACES, const double *values)
NOT("clocks", SetIntervalFraction, PLACES, const uint64_t *values, const uint64_t *resolutions)
NOT("clocks", SetShiftDecimal, PLACES, const double *values)
NOT("clocks", SetShiftFraction, PLACES, const uint64_t *values, const uint64_t *resolutions)
NOT("derivatives", GetOutputDerivatives, PLACES, const int32_t *orders, double *values, size_t n)
NOT("derivatives", GetDirectionalDerivative, PLACES, const unsigned *by, size_t m, const double *seed, size_t k,
    double *values, size_t n)
NOT("derivatives", GetAdjointDerivative, PLACES, const unsigned *by, size_t m, const double *seed, size_t k,
    double *values, size_t n)
NOT("states of model exchange", SetContinuousStates, const double *values, size_t count)
NOT("states of model exchange", GetContinuousStateDerivatives, double *values, size_t count)
NOT("states of model exchange", GetEventIndicators, double *values, size_t count)
NOT("states of model exchange", GetContinuousStates, double *values, size_t count)
NOT("states of model exchange", GetNominalsOfContinuousStates, double *values, size_t count)
FMI(status, EvaluateDiscreteStates)(void *one) { (void)one; return OK; }
FMI(status, EnterEventMode)(void *one) { NONE(one, "event mode"); }
FMI(status, EnterContinuousTimeMode)(void *one) { NONE(one, "model exchange"); }
FMI(status, CompletedIntegratorStep)(void *one, bool fixed, bool *event, bool *ends) {
  (void)fixed; (void)event; (void)ends;
  NONE(one, "model exchange");
}
FMI(status, SetTime)(void *one, double time) { (void)time; NONE(one, "model exchange"); }
FMI(status, GetNumberOfEventIndicators)(void *one, size_t *n) { (void)one; *n = 0; return OK; }
FMI(status, GetNumberOfContinuousStates)(void *one, size_t *n) { (void)one; *n = 0; return OK; }
FMI(status, ActivateModelPartition)(void *one, unsigned clock, double time) {
  (void)clock; (void)time;
  NONE(one, "clocks");
}
#endif
