/* A small FMI 2.0 co-simulation unit, to try the orchestrator on a library that is not ours: it keeps the pointer to the
   callbacks, wants memory from its environment, and logs with printf arguments.
   Output 1 = gain * input (direct), output 2 = integral of the input. It fails, and is slow, as its parameters say. It guarantees something as long
   as the input is at most the parameter "largest". The parameters "delay" and "actuation.delay" do nothing. It refuses to be read between
   setting and stepping, once it is initialized, as FMI 2.0.5, section 4.2.1, allows it to.
   What it does wrong is chosen by the compiler's flags: -DENDS: a discarded step ends the simulation; -DVERSION: its version; -DDIRECT(value),
   -DITEM(value), -DTRUTH(value): what becomes of output.direct, guarantee.status, guarantee.inForce after two steps; -DRESETS=0: fmi2Reset leaves
   the state as it is; -DPLACE=STEP -DHOW=ABORT: fault.h. */
#define _POSIX_C_SOURCE 199309L
#include <stddef.h>
#include <time.h>
#include "fault.h"

#ifndef ENDS
#define ENDS 0
#endif
#ifndef RESETS
#define RESETS 1
#endif
#ifndef VERSION
#define VERSION "2.0"
#endif
#ifndef DIRECT
#define DIRECT(value) (value)
#endif
#ifndef ITEM
#define ITEM(value) (value)
#endif
#ifndef TRUTH
#define TRUTH(value) (value)
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef struct {
    const Callbacks *callbacks;
    const char *name;
    double input, state, gain, fail_time, pause, delay, transport, largest;
    int fail_status, flag, kind, count, seed, runs, is_set;
    char text[64];
} Unit;

enum { OK = 0, WARNING = 1, ERROR = 3, FATAL = 4 };

static int complain(Unit *unit, int status, const char *what, double value) {
    unit->callbacks->logger(unit->callbacks->environment, unit->name, status, "trouble", "%s %g", what, value);
    return status;
}

static int refuses(Unit *unit) {
    if (!unit->runs || !unit->is_set) return 0;
    complain(unit, ERROR, "it is read after it was set, before a step; steps:", unit->count);
    return 1;
}

static void start(Unit *unit, const Callbacks *callbacks) {
    *unit = (Unit){.callbacks = callbacks, .name = "unit", .gain = 2.0, .state = 1.0, .fail_time = 1e9, .fail_status = ERROR,
                   .kind = 1, .largest = 1000.0};
}

const char *fmi2GetVersion(void) { return VERSION; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    (void)type, (void)resources, (void)visible, (void)logging;
    if (strcmp(guid, "{u-1}")) {
        callbacks->logger(callbacks->environment, name, ERROR, "error", "it has another GUID than %s", guid);
        return NULL;
    }
    Unit *unit = callbacks->allocate(1, sizeof(Unit));
    start(unit, callbacks);
    fault(INSTANTIATE, callbacks->logger, callbacks->environment);
    return name ? unit : NULL;
}

int fmi2Reset(Unit *unit) {
    if (RESETS) start(unit, unit->callbacks);
    unit->runs = unit->is_set = 0;
    return OK;
}

void fmi2FreeInstance(Unit *unit) {
    fault(FREE, unit->callbacks->logger, unit->callbacks->environment);
    unit->callbacks->release(unit);
}

int fmi2SetupExperiment(Unit *unit, int tolerance_defined, double tolerance, double start, int stop_defined, double stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined;
    return stop > start ? OK : complain(unit, ERROR, "bad stop time", stop);
}

int fmi2EnterInitializationMode(Unit *unit) {
    return unit->gain < 100.0 ? OK : complain(unit, ERROR, "gain too large:", unit->gain);
}
int fmi2ExitInitializationMode(Unit *unit) {
#ifdef REACHES
    reach(REACHES, unit->callbacks->logger, unit->callbacks->environment);
#endif
    fault(INITIALIZE, unit->callbacks->logger, unit->callbacks->environment);
    unit->runs = 1;
    unit->is_set = 0;
    return unit ? OK : ERROR;
}
int fmi2Terminate(Unit *unit) { return unit ? OK : ERROR; }

int fmi2GetReal(Unit *unit, const unsigned *references, size_t n, double *values) {
    if (refuses(unit)) return ERROR;
    if (unit->count >= 2) fault(GET, unit->callbacks->logger, unit->callbacks->environment);
    for (size_t i = 0; i < n; i++) {
        switch (references[i]) {
        case 0: values[i] = unit->input; break;
        case 1:
            values[i] = unit->gain * unit->input;
            if (unit->count >= 2) values[i] = DIRECT(values[i]);
            break;
        case 2: values[i] = unit->state; break;
        case 3: values[i] = unit->gain; break;
        case 4: values[i] = unit->fail_time; break;
        case 12: values[i] = unit->pause; break;
        case 13: values[i] = unit->delay; break;
        case 14: values[i] = unit->transport; break;
        case 15: values[i] = unit->largest; break;
        case 18: values[i] = 1.0 - unit->input / unit->largest; break;
        case 19: values[i] = 0.5 * (1.0 - unit->input / unit->largest); break;
        default: return complain(unit, ERROR, "no such real:", references[i]);
        }
    }
    return OK;
}

int fmi2SetReal(Unit *unit, const unsigned *references, size_t n, const double *values) {
    unit->is_set = 1;
    for (size_t i = 0; i < n; i++) {
        switch (references[i]) {
        case 0: unit->input = values[i]; break;
        case 3: unit->gain = values[i]; break;
        case 4: unit->fail_time = values[i]; break;
        case 12: unit->pause = values[i]; break;
        case 13: unit->delay = values[i]; break;
        case 14: unit->transport = values[i]; break;
        case 15: unit->largest = values[i]; break;
        default: return complain(unit, ERROR, "real cannot be set:", references[i]);
        }
    }
    return OK;
}

int fmi2GetInteger(Unit *unit, const unsigned *references, size_t n, int *values) {
    if (refuses(unit)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        switch (references[i]) {
        case 5: values[i] = unit->fail_status; break;
        case 7: values[i] = unit->kind; break;
        case 11: values[i] = unit->seed; break;
        case 17:
            values[i] = unit->input <= unit->largest ? 1 : 2;
            if (unit->count >= 2) values[i] = ITEM(values[i]);
            break;
        default: values[i] = unit->count;
        }
    }
    return OK;
}

int fmi2SetInteger(Unit *unit, const unsigned *references, size_t n, const int *values) {
    unit->is_set = 1;
    for (size_t i = 0; i < n; i++)
        *(references[i] == 5 ? &unit->fail_status : references[i] == 11 ? &unit->seed : &unit->kind) = values[i];
    return OK;
}

int fmi2GetBoolean(Unit *unit, const unsigned *references, size_t n, int *values) {
    if (refuses(unit)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        values[i] = references[i] == 16 ? unit->input <= unit->largest : unit->flag;
        if (references[i] == 16 && unit->count >= 2) values[i] = TRUTH(values[i]);
    }
    return OK;
}

int fmi2SetBoolean(Unit *unit, const unsigned *references, size_t n, const int *values) {
    unit->is_set = 1;
    for (size_t i = 0; i < n; i++) unit->flag = references ? values[i] : 0;
    return OK;
}

int fmi2SetString(Unit *unit, const unsigned *references, size_t n, const char *const *values) {
    unit->is_set = 1;
    for (size_t i = 0; i < n && references; i++)
        for (size_t k = 0; k < sizeof unit->text - 1 && values[i][k]; k++) unit->text[k] = values[i][k];
    return OK;
}

int fmi2DoStep(Unit *unit, double time, double step, int no_set_state) {
    unit->is_set = 0;
    (void)no_set_state;
#ifdef HARM_BY_GAIN
    if (unit->gain == 13.0) abort();
#endif
    if (time >= 2.0 - 1e-9) fault(STEP, unit->callbacks->logger, unit->callbacks->environment);
    if (time >= unit->fail_time - 1e-9) return complain(unit, unit->fail_status, "out of propellant at", time);
    if (unit->flag) complain(unit, WARNING, "runs hot at", 7.0);
    struct timespec pause = {(time_t)unit->pause, (long)(1e9 * (unit->pause - (double)(time_t)unit->pause))};
    nanosleep(&pause, NULL);
    unit->state += step * unit->input;
    unit->count += 1;
    return OK;
}

int fmi2GetRealStatus(Unit *unit, int kind, double *value) {
    *value = unit->fail_time + 0.5 * kind;
    return OK;
}

int fmi2GetBooleanStatus(Unit *unit, int kind, int *value) {
    *value = unit && kind == 3 && ENDS;
    return OK;
}
