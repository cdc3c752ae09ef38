/* An importer of FMI 3.0 that makes one call in one state: each line of its input names a state, a
   function and the value reference of a Float64. It answers with the status and the last message. It is
   compiled with the headers of the standard, and calls a function with arguments that are valid.

   importer LIBRARY TOKEN ME|CS EVENTS STATES INDICATORS INPUT OUTPUT */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

int main(int count, char **arguments) {
    if (count != 9) return 2;
    const char *token = arguments[2];
    int exchange = !strcmp(arguments[3], "ME"), events = atoi(arguments[4]);
    size_t states = strtoul(arguments[5], NULL, 10), indicators = strtoul(arguments[6], NULL, 10);
    fmi3ValueReference input = (unsigned)atol(arguments[7]), output = (unsigned)atol(arguments[8]);
    library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) { fprintf(stderr, "%s\n", dlerror()); return 1; }
    char state[64], called[64];
    long given;
    while (scanf("%63s %63s %ld", state, called, &given) == 3) {
        fmi3ValueReference reference = (fmi3ValueReference)given;
        fmi3Instance instance = exchange
            ? FUNCTION(fmi3InstantiateModelExchange)("one", token, NULL, fmi3False, fmi3True, NULL, message)
            : FUNCTION(fmi3InstantiateCoSimulation)("one", token, NULL, fmi3False, fmi3True, events, events, NULL, 0, NULL, message, NULL);
        if (!instance || bring(instance, state, exchange, events) != fmi3OK) { printf("could not be brought to %s: %s\n", state, last); continue; }
        double values[256] = {0}, seed = 1.0, time;
        fmi3Boolean a, b, c;
        fmi3FMUState saved = NULL, copy = NULL;
        size_t size = 0;
        int status = CALL(fmi3GetFMUState, &saved) | CALL(fmi3SerializedFMUStateSize, saved, &size);
        fmi3Byte *bytes = calloc(size + 1, 1);
        status |= CALL(fmi3SerializeFMUState, saved, bytes, size);
        if (status != fmi3OK) printf("no state was saved in %s: ", state);
        last[0] = '\0';
        if (exchange && strcmp(state, "instantiated") && strcmp(state, "initialization")) CALL(fmi3GetContinuousStates, values, states);
        if IS(fmi3EnterInitializationMode) status = initialize(instance);
        else if IS(fmi3ExitInitializationMode) status = CALL(fmi3ExitInitializationMode);
        else if IS(fmi3Terminate) status = CALL(fmi3Terminate);
        else if IS(fmi3Get) status = CALL(fmi3GetFloat64, &reference, 1, values, 1);
        else if IS(fmi3Set) status = CALL(fmi3GetFloat64, &reference, 1, values, 1) | CALL(fmi3SetFloat64, &reference, 1, values, 1);
        else if IS(fmi3GetDirectionalDerivative) status = CALL(fmi3GetDirectionalDerivative, &output, 1, &input, 1, &seed, 1, values, 1);
        else if IS(fmi3GetAdjointDerivative) status = CALL(fmi3GetAdjointDerivative, &output, 1, &input, 1, &seed, 1, values, 1);
        else if IS(fmi3GetOutputDerivatives) status = CALL(fmi3GetOutputDerivatives, &output, 1, (fmi3Int32[]){1}, values, 1);
        else if IS(fmi3EnterEventMode) status = CALL(fmi3EnterEventMode);
        else if IS(fmi3EvaluateDiscreteStates) status = CALL(fmi3EvaluateDiscreteStates);
        else if IS(fmi3UpdateDiscreteStates) status = update(instance);
        else if IS(fmi3EnterContinuousTimeMode) status = update(instance) ? fmi3Error : CALL(fmi3EnterContinuousTimeMode);
        else if IS(fmi3EnterStepMode) status = update(instance) ? fmi3Error : CALL(fmi3EnterStepMode);
        else if IS(fmi3CompletedIntegratorStep) status = CALL(fmi3CompletedIntegratorStep, fmi3True, &a, &b);
        else if IS(fmi3SetTime) status = CALL(fmi3SetTime, 0.0);
        else if IS(fmi3SetContinuousStates) status = CALL(fmi3SetContinuousStates, values, states);
        else if IS(fmi3GetEventIndicators) status = CALL(fmi3GetEventIndicators, values, indicators);
        else if IS(fmi3GetContinuousStates) status = CALL(fmi3GetContinuousStates, values, states);
        else if IS(fmi3GetContinuousStateDerivatives) status = CALL(fmi3GetContinuousStateDerivatives, values, states);
        else if IS(fmi3GetNominalsOfContinuousStates) status = CALL(fmi3GetNominalsOfContinuousStates, values, states);
        else if IS(fmi3GetNumberOfContinuousStates) status = CALL(fmi3GetNumberOfContinuousStates, &size);
        else if IS(fmi3GetNumberOfEventIndicators) status = CALL(fmi3GetNumberOfEventIndicators, &size);
        else if IS(fmi3DoStep) status = CALL(fmi3DoStep, 0.0, 0.04, fmi3True, &a, &b, &c, &time);
        else if IS(fmi3SetDebugLogging) status = CALL(fmi3SetDebugLogging, fmi3True, 0, NULL);
        else if IS(fmi3Reset) status = CALL(fmi3Reset);
        else if IS(fmi3GetFMUState) status = CALL(fmi3GetFMUState, &saved);
        else if IS(fmi3SetFMUState) status = CALL(fmi3SetFMUState, saved);
        else if IS(fmi3FreeFMUState) status = CALL(fmi3FreeFMUState, &saved);
        else if IS(fmi3SerializedFMUStateSize) status = CALL(fmi3SerializedFMUStateSize, saved, &size);
        else if IS(fmi3SerializeFMUState) status = CALL(fmi3SerializeFMUState, saved, bytes, size);
        else if IS(fmi3DeserializeFMUState) status = CALL(fmi3DeserializeFMUState, bytes, size, &copy);
        else if IS(fmi3FreeInstance) status = fmi3OK;
        else status = -1;
        printf("%d %s\n", status, last);
        free(bytes);
        CALL(fmi3FreeFMUState, &copy);
        CALL(fmi3FreeFMUState, &saved);
        CALL(fmi3FreeInstance);
    }
    return 0;
}
