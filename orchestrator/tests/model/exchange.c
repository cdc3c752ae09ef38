/* Small FMUs for model exchange by FMI 2.0, one for each -DKIND=…. They refuse every call in a mode in which FMI 2.0.5, section 3.2.3, does
   not allow it. Output "mark" is the time of the last event, and "events" counts evaluations of the discrete states after initialization. */
#include <math.h>
#include <stddef.h>

/* What the states x and v do. */
enum Kind {
    BALL,    /* bounces with half its speed, and lies still below a speed of 0.1 */
    SWING,   /* x'' = -x, an event at each zero of x, after which the nominal values have changed */
    TIMER,   /* no states: events at 0.25, 0.5, …, that of 1.5 ends the simulation */
    STEPPER, /* x' = 1, a step event behind 0.55 sets x back to 0 */
    CHATTER, /* x' runs towards the zero of x from both sides */
    ENDING,  /* x' = 1, a completed step behind 0.5 ends the simulation */
    STIFF,   /* x' = -1e6 (x - cos t) */
    HELD,    /* x' = the integer input, v' = the real input */
    COOLING, /* x' = -(x - AMBIENT) from START on, an event where x passes THRESHOLD */
    DOMAIN,  /* x' = 1 for x up to 1.001 only, an event at 1 sets x back to 0 */
    RESTLESS, /* the discrete states never settle */
    ANNOUNCE /* x' = 1, the next event is announced for the time NEXT */
};

#if !defined(NEXT)
#define NEXT INFINITY
#endif
#if !defined(START)
#define START 0.0
#define AMBIENT 0.0
#define THRESHOLD 0.0
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef struct {
    int needs_another, terminates, changes_nominals, changes_states, has_next;
    double next;
} EventInfo;

enum Mode { INSTANTIATED = 1, INITIALIZATION = 2, EVENT = 4, CONTINUOUS = 8, TERMINATED = 16 };
enum { OK = 0, DISCARD = 2, ERROR = 3 };
static const char *const names[] = {"", "instantiated", "initialization", "", "event", "", "", "", "continuous"};

typedef struct {
    const Callbacks *callbacks;
    enum Mode mode;
    double time, x[2], input, mark, next;
    int whole, events, evaluations, side, steps, has_new_nominals;
} Model;

static Model *start(Model *m, const Callbacks *callbacks) {
    *m = (Model){.callbacks = callbacks, .mode = INSTANTIATED, .next = 0.25, .side = 1, .has_new_nominals = 1};
    m->x[0] = KIND == STIFF ? 1.0 / (1.0 + 1e-12) : KIND == BALL || KIND == SWING ? 1.0 : KIND == CHATTER ? 0.35 : START;
    return m;
}

static int wrong(Model *m, const char *call) {
    m->callbacks->logger(m->callbacks->environment, "m", ERROR, "mode", "%s is called in the mode %s", call, names[m->mode]);
    return ERROR;
}
#define NEEDS(modes) if (!(m->mode & (modes))) return wrong(m, __func__)

const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks, int visible, int logging) {
    (void)guid, (void)resources, (void)visible, (void)logging;
    return name && type == 0 ? start(callbacks->allocate(1, sizeof(Model)), callbacks) : NULL;
}
void fmi2FreeInstance(Model *m) { m->callbacks->release(m); }
int fmi2Reset(Model *m) { return start(m, m->callbacks) ? OK : ERROR; }
int fmi2SetupExperiment(Model *m, int has_tolerance, double tolerance, double begin, int has_stop, double stop) {
    NEEDS(INSTANTIATED);
    m->time = begin;
    return has_tolerance && tolerance > 0.0 && has_stop && stop > begin ? OK : ERROR;
}
int fmi2EnterInitializationMode(Model *m) { NEEDS(INSTANTIATED); m->mode = INITIALIZATION; return OK; }
int fmi2ExitInitializationMode(Model *m) { NEEDS(INITIALIZATION); m->mode = EVENT; return OK; }
int fmi2EnterEventMode(Model *m) { NEEDS(CONTINUOUS); m->mode = EVENT; return OK; }
int fmi2EnterContinuousTimeMode(Model *m) { NEEDS(EVENT); m->mode = CONTINUOUS; return OK; }
int fmi2Terminate(Model *m) { NEEDS(EVENT | CONTINUOUS); m->mode = TERMINATED; return OK; }

int fmi2NewDiscreteStates(Model *m, EventInfo *info) {
    NEEDS(EVENT);
    *info = (EventInfo){0};
    m->events++;
    m->mark = m->time;
    switch (KIND) {
    case BALL:
        if (m->x[0] > 0.0 || m->x[1] >= 0.0) break;
        m->x[0] = 0.0;
        m->x[1] = m->x[1] < -0.2 ? -0.5 * m->x[1] : 0.0;
        m->side = m->x[1] > 0.0;
        info->changes_states = 1;
        break;
    case TIMER:
        while (m->next <= m->time + 1e-12) m->next += 0.25;
        info->has_next = 1;
        info->next = m->next;
        info->terminates = m->next > 1.6;
        break;
    case DOMAIN:
    case STEPPER:
        if (m->x[0] < 0.5) break;
        m->x[0] = 0.0;
        info->changes_states = 1;
        break;
    case SWING: info->changes_nominals = m->has_new_nominals = 1; break;
    case CHATTER: m->side = m->x[0] > 0.0; break;
    case ANNOUNCE: info->has_next = 1, info->next = NEXT; break;
    case RESTLESS: info->needs_another = 1; break;
    default: break;
    }
    return OK;
}

int fmi2CompletedIntegratorStep(Model *m, int no_set_state, int *enters_event_mode, int *terminates) {
    NEEDS(CONTINUOUS);
    (void)no_set_state;
    m->steps++;
    *enters_event_mode = KIND == STEPPER && m->x[0] > 0.55;
    *terminates = KIND == ENDING && m->x[0] > 0.5;
    return OK;
}

int fmi2SetTime(Model *m, double time) { NEEDS(EVENT | CONTINUOUS); m->time = time; return OK; }
int fmi2SetContinuousStates(Model *m, const double *x, size_t n) {
    NEEDS(CONTINUOUS);
    if (KIND == DOMAIN && x[0] > 1.001) return DISCARD;
    for (size_t i = 0; i < n; i++) m->x[i] = x[i];
    return n == 2 ? OK : ERROR;
}
int fmi2GetContinuousStates(Model *m, double *x, size_t n) {
    NEEDS(EVENT | CONTINUOUS);
    for (size_t i = 0; i < n; i++) x[i] = m->x[i];
    return n == 2 ? OK : ERROR;
}
int fmi2GetNominalsOfContinuousStates(Model *m, double *x, size_t n) {
    NEEDS(EVENT | CONTINUOUS);
    if (!m->has_new_nominals) return wrong(m, "a second reading of the nominal values");
    m->has_new_nominals = 0;
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return OK;
}
int fmi2GetDerivatives(Model *m, double *d, size_t n) {
    NEEDS(EVENT | CONTINUOUS);
    if (m->has_new_nominals) return wrong(m, "fmi2GetDerivatives, before the nominal values are read,");
    m->evaluations++;
    d[0] = d[1] = 0.0;
    switch (KIND) {
    case BALL: d[0] = m->x[1], d[1] = m->x[0] == 0.0 && m->x[1] == 0.0 ? 0.0 : -10.0; break;
    case SWING: d[0] = m->x[1], d[1] = -m->x[0]; break;
    case CHATTER: d[0] = m->side ? -1.0 : 1.0; break;
    case STIFF: d[0] = -1e6 * (m->x[0] - cos(m->time)); break;
    case COOLING: d[0] = AMBIENT - m->x[0]; break;
    case HELD: d[0] = m->whole, d[1] = m->input; break;
    default: d[0] = 1.0;
    }
    return n == 2 ? OK : ERROR;
}
int fmi2GetDirectionalDerivative(Model *m, const unsigned *unknown, size_t rows, const unsigned *known, size_t columns, const double *seed,
                                 double *added) {
    NEEDS(EVENT | CONTINUOUS);
    for (size_t i = 0; i < rows; i++) added[i] = KIND == STIFF && unknown[i] == 2 && known[0] == 0 ? -1e6 * seed[0] : 0.0;
    return columns == 1 ? OK : ERROR;
}
int fmi2GetEventIndicators(Model *m, double *z, size_t n) {
    NEEDS(EVENT | CONTINUOUS);
    z[0] = KIND == BALL || KIND == SWING || KIND == CHATTER ? m->x[0] : KIND == DOMAIN ? 1.0 - m->x[0] : KIND == COOLING ? m->x[0] - THRESHOLD : 1.0;
    return n == 1 ? OK : ERROR;
}

int fmi2GetReal(Model *m, const unsigned *references, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) {
        double all[] = {m->x[0], m->x[1], 0.0, 0.0, m->input, m->mark};
        values[i] = all[references[i]];
    }
    return OK;
}
int fmi2SetReal(Model *m, const unsigned *references, size_t n, const double *values) {
    NEEDS(INSTANTIATED | INITIALIZATION | EVENT);
    for (size_t i = 0; i < n; i++) *(references[i] == 4 ? &m->input : &m->x[references[i]]) = values[i];
    return OK;
}
int fmi2GetInteger(Model *m, const unsigned *references, size_t n, int *values) {
    for (size_t i = 0; i < n; i++) {
        int all[] = {m->whole, m->events, m->evaluations, m->steps};
        values[i] = all[references[i]];
    }
    return OK;
}
int fmi2SetInteger(Model *m, const unsigned *references, size_t n, const int *values) {
    NEEDS(INSTANTIATED | INITIALIZATION | EVENT);
    for (size_t i = 0; i < n && references; i++) m->whole = values[i];
    return OK;
}
int fmi2GetBoolean(Model *m, const unsigned *r, size_t n, int *v) { return m && r && n && v ? ERROR : OK; }
int fmi2SetBoolean(Model *m, const unsigned *r, size_t n, const int *v) { return m && r && n && v ? ERROR : OK; }
int fmi2SetString(Model *m, const unsigned *r, size_t n, const char *const *v) { return m && r && n && v ? ERROR : OK; }
