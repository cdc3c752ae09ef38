/* An FMU for co-simulation by FMI 2.0: y = u + p. */
#include <stddef.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
} Callbacks;
typedef struct {
    const Callbacks *callbacks;
    double values[3];
} Model;

const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks, int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    return m;
}
void fmi2FreeInstance(Model *m) { m->callbacks->release(m); }
int fmi2SetupExperiment(Model *m, int has_tolerance, double tolerance, double begin, int has_stop, double stop) {
    return m && !has_tolerance && tolerance == 0.0 && has_stop && stop > begin ? 0 : 3;
}
int fmi2EnterInitializationMode(Model *m) { return m ? 0 : 3; }
int fmi2ExitInitializationMode(Model *m) { return m ? 0 : 3; }
int fmi2Terminate(Model *m) { return m ? 0 : 3; }
int fmi2DoStep(Model *m, double time, double step, int keeps) { return m && keeps && step > 0.0 && time >= 0.0 ? 0 : 3; }
int fmi2GetReal(Model *m, const unsigned *references, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) values[i] = references[i] < 2 ? m->values[references[i]] : m->values[0] + m->values[1];
    return 0;
}
int fmi2SetReal(Model *m, const unsigned *references, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) m->values[references[i]] = values[i];
    return 0;
}
#define NONE(name) int fmi2##name(Model *m, const void *r, size_t n, const void *v) { return m && r && n && v ? 3 : 0; }
NONE(GetInteger) NONE(GetBoolean) NONE(SetInteger) NONE(SetBoolean) NONE(SetString)
int fmi2GetRealStatus(Model *m, int kind, double *value) { return m && kind && value ? 3 : 0; }
int fmi2GetBooleanStatus(Model *m, int kind, int *value) { return m && kind && value ? 3 : 0; }
