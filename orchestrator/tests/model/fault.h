/* Harm that a model does in the place PLACE, in the way HOW. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifndef _WIN32
#include <pthread.h>
#endif
#include <unistd.h>

enum { NOWHERE, LOAD, INSTANTIATE, INITIALIZE, GET, STEP, FREE, UNLOAD };
enum { EXIT, QUICK_EXIT, ABORT, SEGFAULT, DIVISION, ENDLESS, OVERWRITE, MEMORY, FLOOD, THREAD_EXIT, THREAD_SEGFAULT, LOGS, FLOATS };

#ifndef PLACE
#define PLACE NOWHERE
#endif
#ifndef HOW
#define HOW EXIT
#endif
/* The floating-point environment that FLOATS leaves behind. */
#ifndef MXCSR
#define MXCSR 0x1f80
#endif

typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);

#ifndef _WIN32
static void *exits(void *none) { exit(none != NULL); }
static void *crashes(void *none) { *(volatile int *)16 = 1; return none; }
static void in_thread(void *(*function)(void *)) {
    pthread_t thread;
    pthread_create(&thread, NULL, function, NULL);
    pthread_join(thread, NULL);
}
static Logger thread_logger;
static void *logs(void *none) {
    thread_logger((void *)2, "model", 1, "odd", "from a thread");
    return none;
}
#endif

static void fault(int place, Logger logger, void *environment) {
    if (place != PLACE) return;
    switch (HOW) {
    case EXIT: exit(0);
    case QUICK_EXIT: _exit(0);
    case ABORT: fputs("a bolt is loose\n", stderr); abort();
    case SEGFAULT: *(volatile int *)16 = 1; break;
    /* Once only: whoever swallows the signal goes on as if nothing had been. */
    case DIVISION: {
        static int is_sent;
        if (!is_sent++) raise(SIGFPE);
        break;
    }
    case ENDLESS: for (;;) { volatile int i = 0; (void)i; }
    case OVERWRITE: {
        volatile char *array = malloc(32);
        for (long i = 0; i < 1L << 40; i++) array[i] = 0x41;
        break;
    }
    case MEMORY:
        for (;;) {
            char *more = malloc(1 << 20);
            if (!more) { fputs("no memory is left\n", stderr); abort(); }
            memset(more, 1, 1 << 20);
        }
#ifndef _WIN32
    case THREAD_EXIT: in_thread(exits); break;
    case THREAD_SEGFAULT: in_thread(crashes); break;
    /* Some FMUs hand back no pointer to the environment, or their own. */
    case LOGS: {
        static int own;
        if (!logger) break;
        thread_logger = logger;
        logger((void *)2, "model", 1, "odd", "two");
        logger(NULL, "model", 1, "odd", "nothing");
        logger(&own, "model", 1, "odd", "its own");
        in_thread(logs);
        break;
    }
#endif
#ifdef __x86_64__
    case FLOATS: {
        unsigned mxcsr = MXCSR;
        unsigned short control = 0x37f & (mxcsr >> 7 | 0x340);
        __asm__ volatile("ldmxcsr %0; fldcw %1" : : "m"(mxcsr), "m"(control));
        break;
    }
#endif
    case FLOOD:
        for (int i = 0; i < 200000; i++) {
            if (logger) logger(environment, "model", i % 2 ? 3 : 1, "flood", "wave %d", i);
            printf("wave %d\n", i);
        }
    }
}

__attribute__((constructor)) static void loaded(void) { fault(LOAD, NULL, NULL); }
__attribute__((destructor)) static void unloaded(void) { fault(UNLOAD, NULL, NULL); }
