/* An importer of FMI 3.0: each line of its input names a state, functions with commas between them, and
   the value reference of a Float64. It brings an instance to the state, calls the functions with valid
   arguments, and answers with each status and the last message, and at the end with its largest memory in kB. It is
   compiled with the headers of the standard.

   importer LIBRARY TOKEN ME|CS EVENTS STATES INDICATORS INPUT OUTPUT */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include "fmi3Functions.h"

#define FUNCTION(name) ((name##TYPE *)function(#name))
#define CALL(name, ...) FUNCTION(name)(instance, ##__VA_ARGS__)
#define IS(name) (strcmp(called, #name) == 0)

static void *library;
static char last[4096];

static void *function(const char *name) {
    void *found = dlsym(library, name);
    if (!found) { fprintf(stderr, "%s\n", dlerror()); exit(1); }
    return found;
}

static void message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text) {
    (void)environment, (void)status, (void)category;
    snprintf(last, sizeof last, "%s", text);
    for (char *at = last; *at; at++) if (*at == '\n') *at = ' ';
}

static fmi3Status initialize(fmi3Instance instance) {
    return CALL(fmi3EnterInitializationMode, fmi3False, 0.0, 0.0, fmi3False, 0.0);
}

static fmi3Status update(fmi3Instance instance) {
    fmi3Boolean a, b, c, d, e;
    fmi3Float64 time;
    return CALL(fmi3UpdateDiscreteStates, &a, &b, &c, &d, &e, &time);
}

/* Brings a new instance to a state by calls that must succeed. */
static int bring(fmi3Instance instance, const char *state, int exchange, int events) {
    if (!strcmp(state, "instantiated")) return fmi3OK;
    int status = initialize(instance);
    if (!strcmp(state, "initialization")) return status;
    status |= CALL(fmi3ExitInitializationMode);
    if (!strcmp(state, "terminated")) return status | CALL(fmi3Terminate);
    if (!strcmp(state, "event")) return status;
    if (!exchange && !events) return status;
    status |= update(instance);
    return status | (exchange ? CALL(fmi3EnterContinuousTimeMode) : CALL(fmi3EnterStepMode));
}

/* An instance with what its importer keeps. */
typedef struct {
    fmi3Instance instance;
    size_t states, indicators, size;
    fmi3ValueReference reference, input, output;
    fmi3FMUState saved;
    fmi3Byte *bytes;
    double time, saved_time;
} Unit;

static int call(Unit *unit, const char *called) {
    fmi3Instance instance = unit->instance;
    fmi3ValueReference reference = unit->reference;
    size_t states = unit->states;
    double values[256] = {0}, seed = 1.0, time;
    fmi3Boolean a, b, c;
    fmi3FMUState copy = NULL;
    int status = -1;
    if IS(fmi3EnterInitializationMode) status = initialize(instance);
    else if IS(fmi3ExitInitializationMode) status = CALL(fmi3ExitInitializationMode);
    else if IS(fmi3Terminate) status = CALL(fmi3Terminate);
    else if IS(fmi3Get) status = CALL(fmi3GetFloat64, &reference, 1, values, 1);
    else if IS(fmi3Set) {
        /* The value that it has; a state in which it cannot be read does not matter. */
        status = CALL(fmi3GetFloat64, &reference, 1, values, 1) | CALL(fmi3SetFloat64, &reference, 1, values, 1);
    }
    else if IS(fmi3GetDirectionalDerivative) status = CALL(fmi3GetDirectionalDerivative, &unit->output, 1, &unit->input, 1, &seed, 1, values, 1);
    else if IS(fmi3GetAdjointDerivative) status = CALL(fmi3GetAdjointDerivative, &unit->output, 1, &unit->input, 1, &seed, 1, values, 1);
    else if IS(fmi3GetOutputDerivatives) status = CALL(fmi3GetOutputDerivatives, &unit->output, 1, (fmi3Int32[]){1}, values, 1);
    else if IS(fmi3EnterEventMode) status = CALL(fmi3EnterEventMode);
    else if IS(fmi3EvaluateDiscreteStates) status = CALL(fmi3EvaluateDiscreteStates);
    else if IS(fmi3UpdateDiscreteStates) status = update(instance);
    else if IS(fmi3EnterContinuousTimeMode) status = update(instance) ? fmi3Error : CALL(fmi3EnterContinuousTimeMode);
    else if IS(fmi3EnterStepMode) status = update(instance) ? fmi3Error : CALL(fmi3EnterStepMode);
    else if IS(fmi3CompletedIntegratorStep) status = CALL(fmi3CompletedIntegratorStep, fmi3True, &a, &b);
    else if IS(fmi3SetTime) status = CALL(fmi3SetTime, unit->time);
    else if IS(fmi3SetContinuousStates) {
        if (CALL(fmi3GetContinuousStates, values, states) != fmi3OK) return fmi3Error;
        status = CALL(fmi3SetContinuousStates, values, states);
    }
    else if IS(fmi3GetEventIndicators) status = CALL(fmi3GetEventIndicators, values, unit->indicators);
    else if IS(fmi3GetContinuousStates) status = CALL(fmi3GetContinuousStates, values, states);
    else if IS(fmi3GetContinuousStateDerivatives) status = CALL(fmi3GetContinuousStateDerivatives, values, states);
    else if IS(fmi3GetNominalsOfContinuousStates) status = CALL(fmi3GetNominalsOfContinuousStates, values, states);
    else if IS(fmi3GetNumberOfContinuousStates) status = CALL(fmi3GetNumberOfContinuousStates, &states);
    else if IS(fmi3GetNumberOfEventIndicators) status = CALL(fmi3GetNumberOfEventIndicators, &states);
    else if IS(fmi3DoStep) {
        status = CALL(fmi3DoStep, unit->time, 0.04, fmi3False, &a, &b, &c, &time);
        if (status == fmi3OK) unit->time = time;
    }
    else if IS(fmi3SetDebugLogging) status = CALL(fmi3SetDebugLogging, fmi3True, 0, NULL);
    else if IS(fmi3Reset) { status = CALL(fmi3Reset); unit->time = 0.0; }
    else if IS(fmi3GetFMUState) { status = CALL(fmi3GetFMUState, &unit->saved); unit->saved_time = unit->time; }
    else if IS(fmi3SetFMUState) { status = CALL(fmi3SetFMUState, unit->saved); unit->time = unit->saved_time; }
    else if IS(fmi3FreeFMUState) status = CALL(fmi3FreeFMUState, &copy);
    else if IS(fmi3SerializedFMUStateSize) status = CALL(fmi3SerializedFMUStateSize, unit->saved, &states);
    else if IS(fmi3SerializeFMUState) {
        size_t size = 0;
        status = CALL(fmi3SerializedFMUStateSize, unit->saved, &size);
        fmi3Byte *bytes = calloc(size + 1, 1);
        status |= CALL(fmi3SerializeFMUState, unit->saved, bytes, size);
        free(bytes);
    }
    else if IS(fmi3DeserializeFMUState) status = CALL(fmi3DeserializeFMUState, unit->bytes, unit->size, &copy);
    else if IS(fmi3FreeInstance) status = fmi3OK;
    CALL(fmi3FreeFMUState, &copy);
    return status;
}

int main(int count, char **arguments) {
    if (count != 9) return 2;
    const char *token = arguments[2];
    int exchange = !strcmp(arguments[3], "ME"), events = atoi(arguments[4]);
    library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) { fprintf(stderr, "%s\n", dlerror()); return 1; }
    static char state[64], calls[8192];
    long given;
    while (scanf("%63s %8191s %ld", state, calls, &given) == 3) {
        Unit unit = {
            .states = strtoul(arguments[5], NULL, 10), .indicators = strtoul(arguments[6], NULL, 10),
            .reference = (unsigned)given, .input = (unsigned)atol(arguments[7]), .output = (unsigned)atol(arguments[8]),
        };
        fmi3Instance instance = unit.instance = exchange
            ? FUNCTION(fmi3InstantiateModelExchange)("one", token, NULL, fmi3False, fmi3True, NULL, message)
            : FUNCTION(fmi3InstantiateCoSimulation)("one", token, NULL, fmi3False, fmi3True, events, events, NULL, 0, NULL, message, NULL);
        if (!instance || bring(instance, state, exchange, events) != fmi3OK) { printf("could not be brought to %s: %s\n", state, last); continue; }
        int status = CALL(fmi3GetFMUState, &unit.saved) | CALL(fmi3SerializedFMUStateSize, unit.saved, &unit.size);
        unit.bytes = calloc(unit.size + 1, 1);
        status |= CALL(fmi3SerializeFMUState, unit.saved, unit.bytes, unit.size);
        if (status != fmi3OK) printf("no state was saved in %s: ", state);
        last[0] = '\0';
        for (char *called = strtok(calls, ","); called; called = strtok(NULL, ",")) printf("%d ", call(&unit, called));
        printf("%s\n", last);
        free(unit.bytes);
        CALL(fmi3FreeFMUState, &unit.saved);
        CALL(fmi3FreeInstance);
    }
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    fprintf(stderr, "%ld\n", used.ru_maxrss);
    return 0;
}
