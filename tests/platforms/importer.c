/* An importer of FMI 2.0 that depends on no library: it steps one co-simulation unit on any platform
   and prints the bits of its outputs after every step.

       importer LIBRARY GUID RESOURCES STEPS INPUTS... -- OUTPUTS...

   OUTPUTS are value references of Real variables. INPUTS are written REFERENCE:LOWEST:HIGHEST; they
   jump at each step between their limits, by sums and products alone, so that they are the same
   numbers everywhere. */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

typedef int Status;
typedef void (*Logger)(void *, const char *, Status, const char *, const char *, ...);

struct callbacks {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, Status);
    void *environment;
};

static void logger(void *environment, const char *instance, Status status, const char *category,
                   const char *message, ...) {
    va_list arguments;
    (void)environment, (void)instance, (void)category;
    if (status == 0) return;
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static void *library;

static void *find(const char *name) {
    void *function = FIND(library, name);
    if (!function) {
        fprintf(stderr, "the library has no %s\n", name);
        exit(3);
    }
    return function;
}

static void check(Status status, const char *call) {
    if (status != 0) {
        fprintf(stderr, "%s returned %d\n", call, status);
        exit(4);
    }
}

#define CALL(name, types, ...) check(((Status (*) types)find("fmi2" #name))(__VA_ARGS__), #name)

int main(int count, char **arguments) {
    struct callbacks callbacks = {logger, calloc, free, 0, 0};
    uint32_t inputs[64], outputs[256];
    double values[256], lowest[64], highest[64];
    size_t used = 0, shown = 0;
    int steps, argument = 5;
    if (count < 6) return 2;
    library = OPEN(arguments[1]);
    if (!library) {
        fprintf(stderr, "%s cannot be opened\n", arguments[1]);
        return 3;
    }
    steps = atoi(arguments[4]);
    for (; argument < count && strcmp(arguments[argument], "--") != 0 && used < 64; argument++)
        if (sscanf(arguments[argument], "%u:%lf:%lf", &inputs[used], &lowest[used], &highest[used]) == 3)
            used++;
        else
            return 2;
    for (argument++; argument < count && shown < 256; argument++)
        outputs[shown++] = (uint32_t)atoi(arguments[argument]);

    void *unit = ((void *(*)(const char *, int, const char *, const char *, const struct callbacks *,
                             int, int))find("fmi2Instantiate"))(
        "unit", 1, arguments[2], arguments[3], &callbacks, 0, 0);
    if (!unit) return 5;
    CALL(SetupExperiment, (void *, int, double, double, int, double), unit, 0, 0.0, 0.0, 0, 0.0);
    CALL(EnterInitializationMode, (void *), unit);
    CALL(ExitInitializationMode, (void *), unit);
    for (int step = 0; step < steps; step++) {
        for (size_t i = 0; i < used; i++)
            values[i] = lowest[i] + (highest[i] - lowest[i]) * ((step * (int)(i + 3)) % 17) * 0.0625;
        if (used)
            CALL(SetReal, (void *, const uint32_t *, size_t, const double *), unit, inputs, used, values);
        CALL(DoStep, (void *, double, double, int), unit, 0.04 * step, 0.04, 1);
        CALL(GetReal, (void *, const uint32_t *, size_t, double *), unit, outputs, shown, values);
        for (size_t i = 0; i < shown; i++) {
            uint64_t bits;
            memcpy(&bits, &values[i], sizeof bits);
            printf("%016llx ", (unsigned long long)bits);
        }
        putchar('\n');
    }
    CALL(Terminate, (void *), unit);
    ((void (*)(void *))find("fmi2FreeInstance"))(unit);
    return 0;
}
