/* A small FMU for co-simulation by FMI 2.0, to try the orchestrator on a library that is not ours: it keeps the pointer to the
   callbacks, wants memory from its environment, and logs with printf arguments.
   Output 1 = gain * input (direct), output 2 = integral of the input. It fails, and is slow, as its parameters say. It guarantees something as long
   as the input is at most the parameter "largest". The parameters "delay" and "actuation.delay" do nothing. It refuses to be read between
   setting and stepping, once it is initialized, as FMI 2.0.5, section 4.2.1, allows it to.
   What it does wrong is chosen by the compiler's flags: -DENDS: a discarded step ends the simulation; -DVERSION: its version; -DTROUBLE: the text of its failure; -DDIRECT(value),
   -DITEM(value), -DTRUTH(value): what becomes of output.direct, guarantee.status, guarantee.inForce after two steps; -DRESETS=0: fmi2Reset leaves
   the state as it is; -DSTRICT: it refuses a step beyond the stop time, and its speed is the time that it has reached; -DPLACE=STEP -DHOW=ABORT: fault.h; -DOUTSIDE="\"/folder\"": hostile.h. */
#ifdef OUTSIDE
#define _GNU_SOURCE
#else
#define _DEFAULT_SOURCE
#endif
#include <stddef.h>
#include <time.h>
#include "fault.h"
#ifdef OUTSIDE
#include "hostile.h"
#endif

#ifndef ENDS
#define ENDS 0
#endif
#ifndef RESETS
#define RESETS 1
#endif
#ifndef VERSION
#define VERSION "2.0"
#endif
#ifndef TROUBLE
#define TROUBLE "out of propellant at"
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
    double input, state, gain, fail_time, pause, delay, transport, largest, stop, reached;
    int fail_status, flag, kind, count, seed, runs, is_set;
    char text[64];
} Model;

enum { OK = 0, WARNING = 1, ERROR = 3, FATAL = 4 };

static int complain(Model *model, int status, const char *what, double value) {
    model->callbacks->logger(model->callbacks->environment, model->name, status, "trouble", "%s %g", what, value);
    return status;
}

static int refuses(Model *model) {
    if (!model->runs || !model->is_set) return 0;
    complain(model, ERROR, "it is read after it was set, before a step; steps:", model->count);
    return 1;
}

static void start(Model *model, const Callbacks *callbacks) {
    *model = (Model){.callbacks = callbacks, .name = "model", .gain = 2.0, .state = 1.0, .fail_time = 1e9, .fail_status = ERROR,
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
    Model *model = callbacks->allocate(1, sizeof(Model));
    start(model, callbacks);
    fault(INSTANTIATE, callbacks->logger, callbacks->environment);
    return name ? model : NULL;
}

int fmi2Reset(Model *model) {
    if (RESETS) start(model, model->callbacks);
    model->runs = model->is_set = 0;
    return OK;
}

void fmi2FreeInstance(Model *model) {
    fault(FREE, model->callbacks->logger, model->callbacks->environment);
    model->callbacks->release(model);
}

int fmi2SetupExperiment(Model *model, int tolerance_defined, double tolerance, double start, int stop_defined, double stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined;
    model->stop = stop;
    model->reached = start;
    return stop > start ? OK : complain(model, ERROR, "bad stop time", stop);
}

int fmi2EnterInitializationMode(Model *model) {
    return model->gain < 100.0 ? OK : complain(model, ERROR, "gain too large:", model->gain);
}
int fmi2ExitInitializationMode(Model *model) {
#ifdef OUTSIDE
    attempt(model->seed, model->callbacks->logger, model->callbacks->environment);
#endif
    fault(INITIALIZE, model->callbacks->logger, model->callbacks->environment);
    model->runs = 1;
    model->is_set = 0;
    return model ? OK : ERROR;
}
int fmi2Terminate(Model *model) { return model ? OK : ERROR; }

int fmi2GetReal(Model *model, const unsigned *references, size_t n, double *values) {
    if (refuses(model)) return ERROR;
    if (model->count >= 2) fault(GET, model->callbacks->logger, model->callbacks->environment);
    for (size_t i = 0; i < n; i++) {
        switch (references[i]) {
        case 0: values[i] = model->input; break;
        case 1:
            values[i] = model->gain * model->input;
            if (model->count >= 2) values[i] = DIRECT(values[i]);
            break;
        case 2: values[i] = model->state; break;
        case 3: values[i] = model->gain; break;
#ifdef STRICT
        case 10: values[i] = model->reached; break;
#endif
        case 4: values[i] = model->fail_time; break;
        case 12: values[i] = model->pause; break;
        case 13: values[i] = model->delay; break;
        case 14: values[i] = model->transport; break;
        case 15: values[i] = model->largest; break;
        case 18: values[i] = 1.0 - model->input / model->largest; break;
        case 19: values[i] = 0.5 * (1.0 - model->input / model->largest); break;
        default: return complain(model, ERROR, "no such real:", references[i]);
        }
    }
    return OK;
}

int fmi2SetReal(Model *model, const unsigned *references, size_t n, const double *values) {
    model->is_set = 1;
    for (size_t i = 0; i < n; i++) {
        switch (references[i]) {
        case 0: model->input = values[i]; break;
        case 3: model->gain = values[i]; break;
        case 4: model->fail_time = values[i]; break;
        case 12: model->pause = values[i]; break;
        case 13: model->delay = values[i]; break;
        case 14: model->transport = values[i]; break;
        case 15: model->largest = values[i]; break;
        default: return complain(model, ERROR, "real cannot be set:", references[i]);
        }
    }
    return OK;
}

int fmi2GetInteger(Model *model, const unsigned *references, size_t n, int *values) {
    if (refuses(model)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        switch (references[i]) {
        case 5: values[i] = model->fail_status; break;
        case 7: values[i] = model->kind; break;
        case 11: values[i] = model->seed; break;
        case 17:
            values[i] = model->input <= model->largest ? 1 : 2;
            if (model->count >= 2) values[i] = ITEM(values[i]);
            break;
        default: values[i] = model->count;
        }
    }
    return OK;
}

int fmi2SetInteger(Model *model, const unsigned *references, size_t n, const int *values) {
    model->is_set = 1;
    for (size_t i = 0; i < n; i++)
        *(references[i] == 5 ? &model->fail_status : references[i] == 11 ? &model->seed : &model->kind) = values[i];
    return OK;
}

int fmi2GetBoolean(Model *model, const unsigned *references, size_t n, int *values) {
    if (refuses(model)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        values[i] = references[i] == 16 ? model->input <= model->largest : model->flag;
        if (references[i] == 16 && model->count >= 2) values[i] = TRUTH(values[i]);
    }
    return OK;
}

int fmi2SetBoolean(Model *model, const unsigned *references, size_t n, const int *values) {
    model->is_set = 1;
    for (size_t i = 0; i < n; i++) model->flag = references ? values[i] : 0;
    return OK;
}

int fmi2SetString(Model *model, const unsigned *references, size_t n, const char *const *values) {
    model->is_set = 1;
    for (size_t i = 0; i < n && references; i++)
        for (size_t k = 0; k < sizeof model->text - 1 && values[i][k]; k++) model->text[k] = values[i][k];
    return OK;
}

int fmi2DoStep(Model *model, double time, double step, int no_set_state) {
    model->is_set = 0;
    (void)no_set_state;
#ifdef HARM_BY_GAIN
    if (model->gain == 13.0) abort();
#endif
#ifdef STRICT
    if (time + step > model->stop) return complain(model, ERROR, "beyond the stop time:", time + step - model->stop);
#endif
    model->reached = time + step;
#ifdef MURMURS
    complain(model, ERROR, "murmur", time);
#endif
    if (time >= 2.0 - 1e-9) fault(STEP, model->callbacks->logger, model->callbacks->environment);
    if (time >= model->fail_time - 1e-9) return complain(model, model->fail_status, TROUBLE, time);
    if (model->flag) complain(model, WARNING, "runs hot at", 7.0);
    struct timespec pause = {(time_t)model->pause, (long)(1e9 * (model->pause - (double)(time_t)model->pause))};
    nanosleep(&pause, NULL);
    model->state += step * model->input;
    model->count += 1;
    return OK;
}

int fmi2GetRealStatus(Model *model, int kind, double *value) {
    *value = model->fail_time + 0.5 * kind;
    return OK;
}

int fmi2GetBooleanStatus(Model *model, int kind, int *value) {
    *value = model && kind == 3 && ENDS;
    return OK;
}
