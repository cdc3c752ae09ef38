/* A host of FMI 2.0 with an environment of its own: it flies one co-simulation unit and prints the
   bits of its outputs, of saved states, and of what follows a state that was restored.

       host ENVIRONMENT LIBRARY GUID RESOURCES STEPS OUTPUTS...

   ENVIRONMENT is a list of words that are joined by +: those of `enter`, "stack" for a thread with a
   small stack, and REFERENCE=VALUE for an Integer, Enumeration or Boolean parameter (the last with a
   b in front). OUTPUTS are value references of Real variables. After each call, and in the logger,
   the floating-point environment must be the host's, with the same flags. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { STACK = 64 * 1024, PAINT = 0xa5 };

typedef int Status;
typedef void *Unit;
typedef void (*Logger)(void *, const char *, Status, const char *, const char *, ...);

struct callbacks {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, Status);
    void *environment;
};

static int count;
static char **arguments;
static void *library;
static const char *calling = "start";
static int logged;
/* Communication points, of which every environment has the same bits. */
static double points[4096];

static void die(int code, const char *problem) {
    fprintf(stderr, "%s: %s\n", calling, problem);
    _exit(code);
}

static void trapped(int signal) {
    (void)signal;
    die(5, "SIGFPE");
}

/* The registers of the floating-point environment, with the flags of exceptions. */
struct registers {
    uint64_t parts[4];
};

static struct registers registers(void) {
    struct registers now = {{0}};
#if defined(__x86_64__)
    uint32_t mxcsr;
    uint16_t control, status;
    __asm__ volatile("stmxcsr %0; fnstcw %1; fnstsw %2" : "=m"(mxcsr), "=m"(control), "=m"(status));
    now.parts[0] = mxcsr, now.parts[1] = control, now.parts[2] = status;
#elif defined(__aarch64__)
    __asm__ volatile("mrs %0, fpcr; mrs %1, fpsr" : "=r"(now.parts[0]), "=r"(now.parts[1]));
#endif
    return now;
}

static struct registers hosts;

static void unchanged(void) {
    struct registers now = registers();
    if (memcmp(&now, &hosts, sizeof now) != 0) die(6, "the floating-point environment has changed");
}

static void enter(const char *word) {
    if (!strcmp(word, "upward")) fesetround(FE_UPWARD);
    if (!strcmp(word, "downward")) fesetround(FE_DOWNWARD);
    if (!strcmp(word, "towardzero")) fesetround(FE_TOWARDZERO);
    if (!strcmp(word, "flags")) feraiseexcept(FE_ALL_EXCEPT);
    if (!strcmp(word, "locale") && (!setlocale(LC_ALL, "") || localeconv()->decimal_point[0] != ','))
        die(7, "no locale with a decimal comma");
#ifdef __GLIBC__
    if (!strcmp(word, "traps")) feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
#endif
#if defined(__x86_64__)
    uint32_t mxcsr;
    uint16_t control = 0x27f;
    if (!strcmp(word, "flush")) {
        __asm__ volatile("stmxcsr %0" : "=m"(mxcsr));
        mxcsr |= 0x8040;
        __asm__ volatile("ldmxcsr %0" ::"m"(mxcsr));
    }
    /* The x87 unit of hosts by Microsoft's compilers: 53 bits. */
    if (!strcmp(word, "precision")) __asm__ volatile("fldcw %0" ::"m"(control));
    /* A division by zero of the x87 unit, which the next instruction that waits would raise. */
    if (!strcmp(word, "pending")) {
        control = 0x37b;
        __asm__ volatile("fld1; fldz; fdivrp; fstp %%st(0); fldcw %0" ::"m"(control));
    }
#elif defined(__aarch64__)
    uint64_t control;
    if (!strcmp(word, "flush")) {
        __asm__ volatile("mrs %0, fpcr" : "=r"(control));
        __asm__ volatile("msr fpcr, %0" ::"r"(control | 1 << 24));
    }
#endif
}

static void logger(void *environment, const char *instance, Status status, const char *category,
                   const char *message, ...) {
    (void)environment, (void)instance, (void)category, (void)message, (void)status;
    calling = "the logger";
    unchanged();
    logged++;
}

static void *find(const char *name) {
    calling = name;
    void *function = dlsym(library, name);
    if (!function) die(3, "missing");
    return function;
}

static void *done(void *result) {
    unchanged();
    return result;
}

static void check(Status status, Status expected) {
    unchanged();
    if (status != expected) die(4, "unexpected status");
}

#define STATUS(name, expected, types, ...) \
    check(((Status(*) types)find("fmi2" #name))(__VA_ARGS__), expected)
#define CALL(name, types, ...) STATUS(name, 0, types, __VA_ARGS__)

/* Prints the FNV-1a hash of some bytes. */
static void hash(const char *what, const void *bytes, size_t size) {
    uint64_t sum = 0xcbf29ce484222325;
    for (size_t i = 0; i < size; i++) sum = (sum ^ ((const uint8_t *)bytes)[i]) * 0x100000001b3;
    printf("%s %016llx\n", what, (unsigned long long)sum);
}

static Unit instance(const char *guid, const struct callbacks *callbacks) {
    Unit (*instantiate)(const char *, int, const char *, const char *, const struct callbacks *, int,
                        int) = find("fmi2Instantiate");
    return done(instantiate("unit", 1, guid, arguments[4], callbacks, 0, 0));
}

/* Sets the parameters among the words. */
static void set(Unit unit, char *words) {
    int is_boolean, value;
    uint32_t reference;
    for (char *word = strtok(words, "+"); word; word = strtok(0, "+")) {
        is_boolean = word[0] == 'b';
        if (sscanf(word + is_boolean, "%u=%d", &reference, &value) != 2) continue;
        if (is_boolean)
            CALL(SetBoolean, (Unit, const uint32_t *, size_t, const int *), unit, &reference, 1, &value);
        else
            CALL(SetInteger, (Unit, const uint32_t *, size_t, const int *), unit, &reference, 1, &value);
    }
}

static void fly(Unit unit, int from, int to) {
    static uint32_t outputs[256];
    static double values[256];
    size_t shown = 0;
    for (int i = 6; i < count && shown < 256; i++) outputs[shown++] = (uint32_t)atoi(arguments[i]);
    for (int step = from; step < to; step++) {
        CALL(DoStep, (Unit, double, double, int), unit, points[step], 0.04, 1);
        CALL(GetReal, (Unit, const uint32_t *, size_t, double *), unit, outputs, shown, values);
        hash("outputs", values, shown * sizeof *values);
    }
}

static void *host(void *unused) {
    static struct callbacks callbacks = {logger, calloc, free, 0, 0};
    char *words = strdup(arguments[1]);
    int steps = atoi(arguments[5]);
    (void)unused;
    library = dlopen(arguments[2], RTLD_NOW);
    if (!library) die(3, dlerror());
    for (int step = 0; step < steps; step++) points[step] = step * 0.04;
    signal(SIGFPE, trapped);
    for (char *word = strtok(words, "+"); word; word = strtok(0, "+")) enter(word);
    hosts = registers();

    char *descriptions = done(((char *(*)(void))find("fmu_model_descriptions"))());
    hash("descriptions", descriptions, strlen(descriptions));
    ((void (*)(char *))find("fmu_free_model_descriptions"))(descriptions);
    if (instance("another", &callbacks) || logged != 1) die(4, "accepted a wrong GUID");
    Unit unit = instance(arguments[3], &callbacks);
    if (!unit) die(4, "refused");
    set(unit, strdup(arguments[1]));
    CALL(SetupExperiment, (Unit, int, double, double, int, double), unit, 0, 0.0, 0.0, 0, 0.0);
    CALL(EnterInitializationMode, (Unit), unit);
    CALL(ExitInitializationMode, (Unit), unit);
    fly(unit, 0, steps / 2);

    void *state = 0, *other = 0;
    size_t size = 0;
    CALL(GetFMUstate, (Unit, void **), unit, &state);
    CALL(SerializedFMUstateSize, (Unit, void *, size_t *), unit, state, &size);
    char *bytes = malloc(size);
    CALL(SerializeFMUstate, (Unit, void *, char *, size_t), unit, state, bytes, size);
    hash("state", bytes, size);
    fly(unit, steps / 2, steps);
    CALL(DeSerializeFMUstate, (Unit, const char *, size_t, void **), unit, bytes, size, &other);
    CALL(SetFMUstate, (Unit, void *), unit, other);
    CALL(FreeFMUstate, (Unit, void **), unit, &state);
    fly(unit, steps / 2, steps);
    STATUS(DoStep, 3, (Unit, double, double, int), unit, 0.0, -1.0, 1);
    if (logged != 2) die(4, "an error without a message");
    CALL(Reset, (Unit), unit);
    ((void (*)(Unit))find("fmi2FreeInstance"))(unit);
    unchanged();
    return 0;
}

int main(int length, char **words) {
    count = length, arguments = words;
    if (count < 6 || atoi(arguments[5]) > 4096) return 2;
    setvbuf(stdout, 0, _IOFBF, 1 << 20);
    if (!strstr(arguments[1], "stack")) {
        host(0);
    } else {
        /* The stack lies above a page that nobody may touch, and shows how much of it was used. */
        pthread_t thread;
        pthread_attr_t attributes;
        size_t page = (size_t)sysconf(_SC_PAGESIZE), unused = 0;
        uint8_t *below = mmap(0, page + STACK, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        uint8_t *stack = below + page;
        if (below == MAP_FAILED || mprotect(stack, STACK, PROT_READ | PROT_WRITE)) return 8;
        memset(stack, PAINT, STACK);
        pthread_attr_init(&attributes);
        pthread_attr_setstack(&attributes, stack, STACK);
        if (pthread_create(&thread, &attributes, host, 0)) return 8;
        pthread_join(thread, 0);
        while (stack[unused] == PAINT) unused++;
        fprintf(stderr, "stack %zu\n", STACK - unused);
    }
    return 0;
}
