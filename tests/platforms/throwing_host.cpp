/* A host of FMI 2.0 in C++ whose logger throws exceptions:

       throwing_host LIBRARY GUID RESOURCES

   Each must reach the call that it interrupts, and the unit must be as usable afterwards as if the
   logger had returned. */
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <dlfcn.h>
#include <stdexcept>
#include <string>

typedef int Status;
typedef void *Unit;

static void throw_message(void *, const char *, Status, const char *, const char *message, ...) {
    throw std::runtime_error(message);
}

struct Callbacks {
    void (*logger)(void *, const char *, Status, const char *, const char *, ...) = throw_message;
    void *(*allocate)(size_t, size_t) = calloc;
    void (*release)(void *) = free;
    void (*finished)(void *, Status) = nullptr;
    void *environment = nullptr;
};

static void *library;

template <typename Result, typename... Arguments> static Result call(const char *name, Arguments... arguments) {
    void *function = dlsym(library, name);
    if (!function) exit(3);
    return ((Result(*)(Arguments...))function)(arguments...);
}

/* Ends the program unless the call throws a message with this text. */
template <typename... Arguments> static void throws(const char *text, const char *name, Arguments... arguments) {
    try {
        call<void *>(name, arguments...);
    } catch (const std::runtime_error &error) {
        if (std::string(error.what()).find(text) != std::string::npos) return;
        fprintf(stderr, "%s threw '%s'\n", name, error.what());
        exit(5);
    }
    fprintf(stderr, "%s threw nothing\n", name);
    exit(6);
}

template <typename... Arguments> static void ok(const char *name, Unit unit, Arguments... arguments) {
    if (Status status = call<Status>(name, unit, arguments...)) {
        fprintf(stderr, "%s returned %d\n", name, status);
        exit(4);
    }
}

int main(int count, char **arguments) {
    if (count != 4 || !(library = dlopen(arguments[1], RTLD_NOW))) return 2;
    const char *guid = arguments[2], *resources = arguments[3], *events = "logEvents";
    Callbacks callbacks;
    const uint32_t beyond = UINT32_MAX;
    double value = 0.0;
    throws("no FMU with GUID", "fmi2Instantiate", "unit", 1, "another", resources, &callbacks, 0, 0);
    Unit unit = call<Unit>("fmi2Instantiate", "unit", 1, guid, resources, &callbacks, 0, 0);
    if (!unit) return 4;
    throws("fmi2DoStep: not allowed", "fmi2DoStep", unit, 0.0, 0.04, 1);
    ok("fmi2Reset", unit);
    const char *unknown[] = {"logStatusWarning", "logWeather"};
    throws("no log category", "fmi2SetDebugLogging", unit, 1, (size_t)2, unknown);
    ok("fmi2SetDebugLogging", unit, 1, (size_t)1, &events);
    ok("fmi2SetupExperiment", unit, 0, 0.0, 0.0, 0, 0.0);
    ok("fmi2EnterInitializationMode", unit);
    /* The call has done its work when it throws. */
    throws("initialized", "fmi2ExitInitializationMode", unit);
    for (int step = 0; step < 25; step++) ok("fmi2DoStep", unit, 0.04 * step, 0.04, 1);
    throws("kind 7", "fmi2GetRealStatus", unit, 7, &value);
    ok("fmi2DoStep", unit, 1.0, 0.04, 1);
    throws("does not exist", "fmi2GetReal", unit, &beyond, (size_t)1, &value);
    throws("reset", "fmi2Reset", unit);
    call<void>("fmi2FreeInstance", unit);
    puts("fine");
    return 0;
}
