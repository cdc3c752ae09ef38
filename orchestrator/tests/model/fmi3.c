/* A small FMU for co-simulation by FMI 3.0, to try the orchestrator on a library that is not ours. It refuses calls in a mode in which FMI 3.0 does
   not allow them. The outputs "y" are twice the inputs "u", and change in event mode alone, if it is used. An event comes every "period", which the
   unit announces (-DEARLY: it returns early instead). At "end" it ends the simulation.
   Flags of the compiler: -DBIG: value of the output "big"; -DENDLESS: an event never ends; -DSTUCK: its steps never advance. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifndef BIG
#define BIG 7
#endif
#ifndef EARLY
#define EARLY 0
#endif
#ifndef ENDLESS
#define ENDLESS 0
#endif
#ifndef STUCK
#define STUCK 0
#endif

typedef void (*Log)(void *, int, const char *, const char *);
enum { INSTANTIATED, INITIALIZATION, EVENT, STEP, TERMINATED };
enum { OK = 0, ERROR = 3 };
enum { U = 1, Y, N, SINGLE, ECHO, BIGGEST, EVENTS, BYTE, TEXTS, LETTERS, PERIOD, END, PARTS, FLAG };

typedef struct {
    Log log;
    void *environment;
    int mode, uses_events, is_updated;
    double u[2], y[2], period, end, time, next;
    float single;
    uint8_t byte;
    bool flag;
    int32_t events, parts;
    char texts[2][32];
    const char *shown[2];
} Model;

static int refuse(Model *m, const char *text) {
    m->log(m->environment, ERROR, "logStatusError", text);
    return ERROR;
}

#define MODE(m, wanted, name) if ((m)->mode != (wanted)) return refuse(m, name " in the wrong mode")

static void start(Model *m) {
    Log log = m->log;
    void *environment = m->environment;
    int uses_events = m->uses_events;
    *m = (Model){.log = log, .environment = environment, .uses_events = uses_events, .u = {1, 2}, .period = 1e9, .end = 1e9, .texts = {"a", "bc"}};
}

const char *fmi3GetVersion(void) { return "3.0"; }

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool events, bool early,
                                  const uint32_t *variables, size_t n, void *environment, Log log, void *update) {
    (void)name, (void)visible, (void)logging, (void)variables, (void)n, (void)update;
    Model *m = calloc(1, sizeof(Model));
    m->log = log, m->environment = environment, m->uses_events = events;
    start(m);
    if (strcmp(token, "{u-3}") || resources[0] != '/' || resources[strlen(resources) - 1] != '/' || events != early) {
        refuse(m, "wrong arguments");
        free(m);
        return NULL;
    }
    return m;
}

void fmi3FreeInstance(Model *m) { free(m); }

int fmi3Reset(Model *m) { start(m); return OK; }

int fmi3EnterInitializationMode(Model *m, bool has_tolerance, double tolerance, double begin, bool has_stop, double stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    MODE(m, INSTANTIATED, "fmi3EnterInitializationMode");
    m->mode = INITIALIZATION, m->time = begin, m->next = begin + m->period;
    return OK;
}

static void respond(Model *m) { for (int i = 0; i < 2; i++) m->y[i] = 2 * m->u[i]; }

int fmi3ExitInitializationMode(Model *m) {
    MODE(m, INITIALIZATION, "fmi3ExitInitializationMode");
    respond(m);
    m->mode = m->uses_events ? EVENT : STEP;
    return OK;
}

int fmi3EnterEventMode(Model *m) {
    if (!m->uses_events) return refuse(m, "no event mode");
    MODE(m, STEP, "fmi3EnterEventMode");
    m->mode = EVENT, m->is_updated = 0;
    return OK;
}

int fmi3UpdateDiscreteStates(Model *m, bool *again, bool *ends, bool *nominals, bool *states, bool *announces, double *next) {
    MODE(m, EVENT, "fmi3UpdateDiscreteStates");
    respond(m);
    if (m->time >= m->next - 1e-9) m->next += m->period, m->events++;
    *again = ENDLESS || !m->is_updated, *ends = false, *nominals = *states = false;
    *announces = !EARLY && m->period < 1e9, *next = m->next, m->is_updated = 1;
    return OK;
}

int fmi3EnterStepMode(Model *m) {
    MODE(m, EVENT, "fmi3EnterStepMode");
    if (!m->is_updated) return refuse(m, "the event was not handled");
    m->mode = STEP;
    return OK;
}

int fmi3DoStep(Model *m, double time, double step, bool last, bool *event, bool *ends, bool *early, double *reached) {
    (void)last;
    MODE(m, STEP, "fmi3DoStep");
    if (time < m->time - 1e-9 || time > m->time + 1e-9) return refuse(m, "a step from another time");
    if (!m->uses_events) respond(m);
    double to = time + step;
    if (STUCK) to = time;
    if (EARLY && m->uses_events && m->next < to) to = m->next;
    *ends = to >= m->end;
    if (*ends) to = m->end, m->log(m->environment, OK, "logEvents", "out of propellant");
    *early = to < time + step, *event = m->uses_events && to >= m->next - 1e-9, *reached = m->time = to;
    m->parts++;
    return OK;
}

int fmi3Terminate(Model *m) { m->mode = TERMINATED; return OK; }

static int can_set(Model *m, uint32_t vr) {
    if (m->mode == INSTANTIATED) return OK;
    if (vr != U && vr != SINGLE && vr != BYTE) return refuse(m, "no input");
    if (m->mode == INITIALIZATION || m->mode == (m->uses_events ? EVENT : STEP)) return OK;
    return refuse(m, "set in the wrong mode");
}

/* Functions that get and set a type: VALUES gives the address and the number of the values of a variable. */
#define TYPE(Name, type, VALUES)                                                                               \
    static type *at##Name(Model *m, uint32_t vr, size_t *n) { *n = 1; VALUES; return NULL; }                   \
    int fmi3Get##Name(Model *m, const uint32_t *vr, size_t count, type *values, size_t n) {                    \
        type *end = values + n;                                                                                \
        for (size_t i = 0, size; i < count; i++, values += size) {                                             \
            type *from = at##Name(m, vr[i], &size);                                                            \
            if (!from || values + size > end) return refuse(m, "no such value");                               \
            memcpy(values, from, size * sizeof(type));                                                         \
        }                                                                                                      \
        return values == end ? OK : refuse(m, "wrong number of values");                                       \
    }                                                                                                          \
    int fmi3Set##Name(Model *m, const uint32_t *vr, size_t count, const type *values, size_t n) {              \
        const type *end = values + n;                                                                          \
        for (size_t i = 0, size; i < count; i++, values += size) {                                             \
            type *to = at##Name(m, vr[i], &size);                                                              \
            if (!to || values + size > end || can_set(m, vr[i])) return ERROR;                                 \
            memcpy(to, values, size * sizeof(type));                                                           \
        }                                                                                                      \
        return values == end ? OK : refuse(m, "wrong number of values");                                       \
    }

TYPE(Float64, double, switch (vr) {
    case U: *n = 2; return m->u;
    case Y: *n = 2; return m->y;
    case PERIOD: return &m->period;
    case END: return &m->end;
})
TYPE(Float32, float, if (vr == SINGLE || vr == ECHO) return &m->single)
TYPE(UInt8, uint8_t, if (vr == BYTE) return &m->byte)
TYPE(Boolean, bool, if (vr == FLAG) return &m->flag)
TYPE(Int32, int32_t, static int32_t letters; letters = (int32_t)(10 * strlen(m->texts[0]) + strlen(m->texts[1]));
     if (vr == LETTERS) return &letters; if (vr == EVENTS) return &m->events; if (vr == PARTS) return &m->parts)
TYPE(Int64, int64_t, static int64_t big; big = m->time >= 1 ? BIG : 0; if (vr == BIGGEST) return &big)

int fmi3GetString(Model *m, const uint32_t *vr, size_t count, const char **values, size_t n) {
    if (count != 1 || vr[0] != TEXTS || n != 2) return refuse(m, "no such text");
    values[0] = m->texts[0], values[1] = m->texts[1];
    return OK;
}

int fmi3SetString(Model *m, const uint32_t *vr, size_t count, const char *const *values, size_t n) {
    if (count != 1 || vr[0] != TEXTS || n != 2 || can_set(m, TEXTS)) return ERROR;
    for (int i = 0; i < 2; i++) strncpy(m->texts[i], values[i], 31);
    return OK;
}

int fmi3GetFMUState(Model *m, void **state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, m, sizeof(Model));
    return OK;
}

int fmi3SetFMUState(Model *m, void *state) { memcpy(m, state, sizeof(Model)); return OK; }

int fmi3FreeFMUState(Model *m, void **state) { (void)m; free(*state); *state = NULL; return OK; }
