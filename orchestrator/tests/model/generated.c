/* An FMU for model exchange by FMI 2.0 whose equations and events are parameters, and which keeps the times of its first events. */
#include <math.h>
#include <stddef.h>

enum Family {
    LINE,  /* x' = rate */
    DECAY, /* x' = -rate (x - aim) */
    SWING, /* x' = rate v, v' = -rate x */
    FALL,  /* x' = v, v' = -rate */
    CUBIC  /* x' = v, v' = w, w' = rate */
};
/* What an event does beside being counted. */
enum Action { NOTHING, RESET, BOUNCE };
/* How the next time event is announced. */
enum Announcement { NEVER, INFINITE, PERIODIC, GROWING };
enum { FAMILY, ACTION, ANNOUNCEMENT, BEGIN, SPEED, RATE, AIM, THRESHOLD, SIGN, PERIOD, PARAMETERS };
enum { KEPT = 6, OK = 0, ERROR = 3 };

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
} Callbacks;

typedef struct {
    int needs_another, terminates, changes_nominals, changes_states, has_next;
    double next;
} EventInfo;

typedef struct {
    const Callbacks *callbacks;
    double p[PARAMETERS], time, begin, x[3], next, times[KEPT];
    int side, has_begun, count, ticks;
} Model;

static double indicator(const Model *m) { return m->p[SIGN] * (m->x[0] - m->p[THRESHOLD]); }
static void reset(Model *m) { m->x[0] = m->p[BEGIN], m->x[1] = m->p[SPEED], m->x[2] = 0.0; }

const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks, int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    return m;
}
void fmi2FreeInstance(Model *m) { m->callbacks->release(m); }
int fmi2SetupExperiment(Model *m, int has_tolerance, double tolerance, double begin, int has_stop, double stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    m->begin = m->time = begin;
    return OK;
}
int fmi2EnterInitializationMode(Model *m) { reset(m); return OK; }
int fmi2ExitInitializationMode(Model *m) { m->side = indicator(m) > 0.0; return OK; }
int fmi2EnterEventMode(Model *m) { return m ? OK : ERROR; }
int fmi2EnterContinuousTimeMode(Model *m) { return m ? OK : ERROR; }
int fmi2Terminate(Model *m) { return m ? OK : ERROR; }

int fmi2NewDiscreteStates(Model *m, EventInfo *info) {
    const int announces = m->p[ANNOUNCEMENT], acts = m->p[ACTION];
    *info = (EventInfo){.has_next = announces != NEVER, .next = INFINITY};
    int is_event = (indicator(m) > 0.0) != m->side;
    if (announces > INFINITE) {
        if (m->has_begun && m->time >= m->next) is_event = 1, m->ticks++;
        const double ticks = m->ticks + 1.0, factor = announces == PERIODIC ? ticks : 0.5 * ticks * (ticks + 1.0);
        m->next = info->next = m->begin + factor * m->p[PERIOD];
    }
    if (is_event) {
        if (m->count < KEPT) m->times[m->count] = m->time;
        m->count++;
        if (acts == RESET) reset(m);
        if (acts == BOUNCE) m->x[0] = m->p[THRESHOLD], m->x[1] = -0.8 * m->x[1];
        info->changes_states = acts != NOTHING;
    }
    m->side = acts == BOUNCE && is_event ? m->x[1] > 0.0 : indicator(m) > 0.0;
    m->has_begun = 1;
    return OK;
}
int fmi2CompletedIntegratorStep(Model *m, int no_set_state, int *enters_event_mode, int *terminates) {
    (void)no_set_state;
    *enters_event_mode = *terminates = 0;
    return m ? OK : ERROR;
}
int fmi2SetTime(Model *m, double time) { m->time = time; return OK; }
int fmi2SetContinuousStates(Model *m, const double *x, size_t n) {
    for (size_t i = 0; i < n; i++) m->x[i] = x[i];
    return OK;
}
int fmi2GetContinuousStates(Model *m, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = m->x[i];
    return OK;
}
int fmi2GetNominalsOfContinuousStates(Model *m, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = fabs(m->p[BEGIN]) > 0.0 ? fabs(m->p[BEGIN]) : 1.0;
    return OK;
}
int fmi2GetDerivatives(Model *m, double *d, size_t n) {
    const double rate = m->p[RATE], all[][3] = {{rate, 0.0, 0.0},
                                                {-rate * (m->x[0] - m->p[AIM]), 0.0, 0.0},
                                                {rate * m->x[1], -rate * m->x[0], 0.0},
                                                {m->x[1], -rate, 0.0},
                                                {m->x[1], m->x[2], rate}};
    for (size_t i = 0; i < n; i++) d[i] = all[(int)m->p[FAMILY]][i];
    return OK;
}
int fmi2GetEventIndicators(Model *m, double *z, size_t n) {
    z[0] = indicator(m);
    return n == 1 ? OK : ERROR;
}
int fmi2SetReal(Model *m, const unsigned *references, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) m->p[references[i]] = values[i];
    return OK;
}
int fmi2GetReal(Model *m, const unsigned *references, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) {
        const unsigned r = references[i];
        values[i] = r < PARAMETERS ? m->p[r] : r == 20 ? m->count : r < 30 ? m->times[r - 21] : r < 40 ? m->x[r - 30] : 0.0;
    }
    return OK;
}
#define NONE(name) int fmi2##name(Model *m, const void *r, size_t n, const void *v) { return m && r && n && v ? ERROR : OK; }
NONE(GetInteger) NONE(GetBoolean) NONE(SetInteger) NONE(SetBoolean) NONE(SetString)
