/* The FMUs of exchange.c by FMI 3.0: their two states are one array, and so are the derivatives. */
#include "exchange.c"
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void (*Log)(void *, int, const char *, const char *);

/* What stands in for the environment of FMI 2.0. */
typedef struct {
    Callbacks callbacks;
    Log log;
    void *environment;
} Environment;

static void tell(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    (void)name;
    const Environment *own = environment;
    char text[200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    own->log(own->environment, status, category, text);
}

const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible, bool logging, void *environment,
                                   Log log) {
    (void)name, (void)visible, (void)logging;
    if (strcmp(token, "{e-3}") || resources[0] != '/') return NULL;
    Environment *own = calloc(1, sizeof *own);
    *own = (Environment){.callbacks = {.logger = tell, .environment = own}, .log = log, .environment = environment};
    return start(calloc(1, sizeof(Model)), &own->callbacks);
}
void fmi3FreeInstance(Model *m) { free(m->callbacks->environment), free(m); }
int fmi3EnterInitializationMode(Model *m, bool has_tolerance, double tolerance, double begin, bool has_stop, double stop) {
    int status = fmi2SetupExperiment(m, has_tolerance, tolerance, begin, has_stop, stop);
    return status == OK ? fmi2EnterInitializationMode(m) : status;
}

#define MODE(name) int fmi3##name(Model *m) { return fmi2##name(m); }
MODE(Reset) MODE(ExitInitializationMode) MODE(EnterEventMode) MODE(EnterContinuousTimeMode) MODE(Terminate)
#define VECTOR(name, same) int fmi3##name(Model *m, double *values, size_t n) { return same(m, values, n); }
VECTOR(SetContinuousStates, fmi2SetContinuousStates) VECTOR(GetContinuousStates, fmi2GetContinuousStates)
VECTOR(GetNominalsOfContinuousStates, fmi2GetNominalsOfContinuousStates) VECTOR(GetContinuousStateDerivatives, fmi2GetDerivatives)
VECTOR(GetEventIndicators, fmi2GetEventIndicators)
int fmi3SetTime(Model *m, double time) { return fmi2SetTime(m, time); }

int fmi3UpdateDiscreteStates(Model *m, bool *again, bool *ends, bool *nominals, bool *states, bool *announces, double *next) {
    EventInfo info;
    int status = fmi2NewDiscreteStates(m, &info);
    *again = info.needs_another, *ends = info.terminates, *nominals = info.changes_nominals, *states = info.changes_states;
    *announces = info.has_next, *next = info.next;
    return status;
}
int fmi3CompletedIntegratorStep(Model *m, bool no_set_state, bool *enters_event_mode, bool *terminates) {
    int event, ends, status = fmi2CompletedIntegratorStep(m, no_set_state, &event, &ends);
    *enters_event_mode = event, *terminates = ends;
    return status;
}

/* The array of the states has the reference 0, that of the derivatives 2. */
static size_t length(uint32_t reference) { return reference == 0 || reference == 2 ? 2 : 1; }

int fmi3GetDirectionalDerivative(Model *m, const uint32_t *unknown, size_t rows, const uint32_t *known, size_t columns, const double *seed,
                                 size_t seeds, double *added, size_t results) {
    const uint32_t both[] = {2, 3};
    if (rows != 1 || unknown[0] != 2 || columns != 1 || known[0] != 0 || seeds != 2 || results != 2) return ERROR;
    return fmi2GetDirectionalDerivative(m, both, 2, known, 1, seed, added);
}
int fmi3GetFloat64(Model *m, const uint32_t *references, size_t n, double *values, size_t count) {
    for (size_t i = 0; i < n; i++) {
        for (uint32_t element = 0; element < length(references[i]); element++, values++, count--) {
            const uint32_t reference = references[i] + element;
            fmi2GetReal(m, &reference, 1, values);
        }
    }
    return count ? ERROR : OK;
}
int fmi3SetFloat64(Model *m, const uint32_t *references, size_t n, const double *values, size_t count) {
    for (size_t i = 0; i < n; i++) {
        for (uint32_t element = 0; element < length(references[i]); element++, values++, count--) {
            const uint32_t reference = references[i] + element;
            if (fmi2SetReal(m, &reference, 1, values) != OK) return ERROR;
        }
    }
    return count ? ERROR : OK;
}
/* Integers have references from 10 on. */
int fmi3GetInt32(Model *m, const uint32_t *references, size_t n, int32_t *values, size_t count) {
    for (size_t i = 0; i < n; i++) {
        const uint32_t reference = references[i] - 10;
        fmi2GetInteger(m, &reference, 1, values + i);
    }
    return count == n ? OK : ERROR;
}
int fmi3SetInt32(Model *m, const uint32_t *references, size_t n, const int32_t *values, size_t count) {
    return count == n ? fmi2SetInteger(m, references, n, values) : ERROR;
}
