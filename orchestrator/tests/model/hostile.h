/* Attempts of a model to reach what is not its own, by number. Each returns 1 if it got through. OUTSIDE is a folder with the file "secret" that
   the model may neither read nor change. Nothing here does harm if it gets through: signals are those of number 0, limits are the ones that are
   there. */
#include <errno.h>
#include <fcntl.h>
#include <linux/io_uring.h>
#include <linux/keyctl.h>
#include <netinet/in.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/ioctl.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char *secret(void) { return OUTSIDE "/secret"; }
static const char *fresh(void) { return OUTSIDE "/fresh"; }
static int opens(const char *path, int flags) {
    int file = open(path, flags, 0600);
    if (file >= 0) close(file);
    return file >= 0;
}
static int opens_of_parent(const char *name, int flags) {
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/%s", getppid(), name);
    return opens(path, flags);
}
static int ends(pid_t child) {
    if (child == 0) _exit(0);
    if (child > 0) waitpid(child, NULL, 0);
    return child > 0;
}
/* glibc may not have the call, or may change its arguments. */
#define CALL(...) (syscall(__VA_ARGS__) >= 0)

static int write_file(void) { return opens(fresh(), O_WRONLY | O_CREAT); }
static int append_file(void) { return opens(secret(), O_WRONLY | O_APPEND); }
static int read_file(void) { return opens(secret(), O_RDONLY); }
static int read_home(void) { return opens("/root", O_RDONLY | O_DIRECTORY) || opens("/home", O_RDONLY | O_DIRECTORY); }
static int read_passwords(void) { return opens("/etc/passwd", O_RDONLY); }
static int truncate_file(void) { return truncate(secret(), 1) == 0; }
static int remove_file(void) { return unlink(secret()) == 0; }
static int rename_file(void) { return rename(secret(), "stolen") == 0 || rename(secret(), fresh()) == 0; }
static int link_file(void) { return link(secret(), "linked") == 0 || link(secret(), fresh()) == 0; }
static int follow_link(void) { return symlink(secret(), "there") == 0 && opens("there", O_RDWR); }
static int make_folder(void) { return mkdir(fresh(), 0700) == 0; }
static int change_mode(void) { return chmod(secret(), 0777) == 0; }
static int change_mode_at(void) { return CALL(SYS_fchmodat, AT_FDCWD, secret(), 0777, 0); }
static int change_owner(void) { return chown(secret(), getuid(), getgid()) == 0; }
static int change_times(void) { return utimensat(AT_FDCWD, secret(), NULL, 0) == 0; }
static int set_attribute(void) { return CALL(SYS_setxattr, secret(), "user.a", "b", 1, 0); }
static int make_device(void) { return mknod("device", S_IFCHR | 0600, 0x103) == 0; }
static int make_pipe(void) { return mknod("pipe", S_IFIFO | 0600, 0) == 0; }
static int through_root(void) { return opens("/proc/self/root" OUTSIDE "/secret", O_RDONLY); }
static int through_handle(void) {
    struct { struct file_handle handle; char room[128]; } h = {.handle = {.handle_bytes = 128}};
    int mount = 0;
    if (name_to_handle_at(AT_FDCWD, secret(), &h.handle, &mount, 0) != 0) return 0;
    int folder = open("/usr", O_RDONLY);
    return open_by_handle_at(folder, &h.handle, O_RDONLY) >= 0;
}
static int large_file(void) {
    static char block[1 << 20];
    int file = open("large", O_WRONLY | O_CREAT, 0600), written = 0;
    signal(SIGXFSZ, SIG_IGN);
    while (written < 200 && write(file, block, sizeof block) == sizeof block) written++;
    return file >= 0 && written == 200;
}
static int is_pipe(int file) { struct stat about; return fstat(file, &about) == 0 && S_ISFIFO(about.st_mode); }
/* One pipe is the way to the orchestrator; messages of others on it are tried below. */
static int inherited_file(void) {
    int is_written = 0, pipes = 0;
    for (int file = 3; file < 64; file++) {
        if (is_pipe(file)) pipes++;
        else is_written |= write(file, "x", 1) == 1;
    }
    return is_written || pipes != 1;
}
/* The orchestrator must refuse them while the instance is still being called, and nothing may be read from it. */
static int says(const char *bytes, size_t count) {
    usleep(50000);
    for (int file = 3; file < 64; file++)
        if (is_pipe(file) && write(file, bytes, count) != (ssize_t)count) return 0;
    sleep(20);
    return 1;
}
static int say_anything(void) { return says("anything that is said", 22); }
static int say_much(void) { return says("m\xff\xff\xff\x0fxxxxxxxxxxx", 16); }
static int say_nothing_is_closed(void) { return says("r\4\0\0\0xxxxxxxxlock", 17); }
static int say_it_is_done(void) {
    usleep(50000);
    for (int file = 3; file < 64; file++)
        if (is_pipe(file) && write(file, "d\0\0\0\0xxxxxxxx", 13) != 13) return 1;
    sleep(20);
    return 1;
}
static int lock_file(void) {
    struct flock lock = {.l_type = F_RDLCK};
    return fcntl(open("/etc/ld.so.cache", O_RDONLY), F_SETLK, &lock) == 0;
}
static int waits(void *none) { for (;;) pause(); return none != NULL; }
static int many_threads(void) {
    static char stacks[20000][1024] __attribute__((aligned(16)));
    int flags = CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD | CLONE_SYSVSEM;
    for (int i = 0; i < 20000; i++)
        if (clone(waits, stacks[i] + 1024, flags, NULL) < 0) return 0;
    return 1;
}
static int environment(void) { return getenv("SECRET_KEY") != NULL; }
static int own_environment(void) { return opens("/proc/self/environ", O_RDONLY) || opens("/proc/self/cmdline", O_RDONLY); }
static int connections(void) { return opens("/proc/self/net/tcp", O_RDONLY) || opens("/proc/net/dev", O_RDONLY) || opens("/proc/thread-self/net/unix", O_RDONLY); }
static int mounts(void) { return opens("/proc/self/mountinfo", O_RDONLY) || opens("/proc/mounts", O_RDONLY) || opens("/proc/self/cgroup", O_RDONLY); }
static int users_folder(void) { return opens("loop.toml", O_RDONLY); }
/* Folders that are hard to remove: deeper than any path is long, and closed. Another instance may have made them already. */
static int deep_folders(void) {
    if (chdir(getenv("TMPDIR")) != 0) return 1;
    mkdir("closed", 0700), mkdir("closed/inner", 0), mkdir("last", 0);
    for (int depth = 0; depth < 5000; depth++)
        if (mkdir("d", 0700) != 0 || chdir("d") != 0) break;
    return 0;
}
static int parent_environment(void) { return opens_of_parent("environ", O_RDONLY); }
static int parent_memory(void) { return opens_of_parent("mem", O_RDWR); }
static int parent_files(void) { return opens_of_parent("fd", O_RDONLY | O_DIRECTORY); }
static int parent_command(void) { return opens_of_parent("cmdline", O_RDONLY); }
static int parent_links(void) {
    return opens_of_parent("cwd", O_RDONLY | O_DIRECTORY) || opens_of_parent("root", O_RDONLY | O_DIRECTORY) || opens_of_parent("exe", O_RDONLY) ||
           opens_of_parent("fd/0", O_RDWR | O_NONBLOCK) || opens_of_parent("fd/1", O_RDWR | O_NONBLOCK) || opens_of_parent("fd/2", O_RDWR | O_NONBLOCK);
}
static int parent_score(void) { return opens_of_parent("oom_score_adj", O_WRONLY); }
static int all_processes(void) { return opens("/proc", O_RDONLY | O_DIRECTORY); }
static int shared_folder(void) { return opens("/dev/shm/fresh-of-an-instance", O_RDWR | O_CREAT); }
static int cut_memory(void) {
    int cut = 0;
    for (int file = 3; file < 64; file++) cut |= ftruncate(file, 0) == 0;
    return cut;
}
static int watch_files(void) { return CALL(SYS_inotify_init1, 0) || CALL(SYS_fanotify_init, 0, 0); }
static int change_root(void) { return chroot(".") == 0; }
static int mount_folder(void) { return CALL(SYS_mount, "none", ".", "tmpfs", 0, NULL) || CALL(SYS_fsopen, "tmpfs", 0); }
static int open_tree(void) { return CALL(SYS_open_tree, AT_FDCWD, "/usr", 1); }
static int internet(void) { return socket(AF_INET, SOCK_STREAM, 0) >= 0 || socket(AF_INET6, SOCK_DGRAM, 0) >= 0; }
static int local_socket(void) { return socket(AF_UNIX, SOCK_STREAM, 0) >= 0; }
static int netlink(void) { return socket(AF_NETLINK, SOCK_RAW, 0) >= 0; }
static int packets(void) { return socket(AF_PACKET, SOCK_RAW, 0) >= 0; }
static int socket_pair(void) { int pair[2]; return socketpair(AF_UNIX, SOCK_STREAM, 0, pair) == 0; }
static int signal_parent(void) { return kill(getppid(), 0) == 0; }
static int signal_all(void) { return kill(-1, 0) == 0; }
static int signal_group(void) { return kill(0, 0) == 0 || kill(-getpgid(getppid()), 0) == 0; }
static int signal_thread(void) { return CALL(SYS_tgkill, getppid(), getppid(), 0) || CALL(SYS_tkill, getppid(), 0); }
static int queue_signal(void) {
    siginfo_t information = {.si_code = SI_QUEUE};
    return CALL(SYS_rt_sigqueueinfo, getppid(), 0, &information) || CALL(SYS_rt_tgsigqueueinfo, getppid(), getppid(), 0, &information);
}
static int signal_by_descriptor(void) {
    long parent = syscall(SYS_pidfd_open, getppid(), 0);
    return parent >= 0 || CALL(SYS_pidfd_send_signal, 0, 0, NULL, 0);
}
static int signal_by_pipe(void) {
    int ends[2];
    if (pipe(ends) != 0) return 0;
    return fcntl(ends[0], F_SETOWN, getppid()) == 0 || fcntl(ends[0], F_SETSIG, SIGKILL) == 0;
}
static int signal_by_owner(void) {
    struct f_owner_ex owner = {F_OWNER_PID, getppid()};
    return fcntl(0, F_SETOWN_EX, &owner) == 0;
}
static int signal_by_lease(void) { return fcntl(open("own", O_CREAT | O_RDONLY, 0600), F_SETLEASE, F_RDLCK) == 0; }
static int signal_by_timer(void) {
    struct sigevent event = {.sigev_notify = SIGEV_NONE};
    int timer = 0;
    return CALL(SYS_timer_create, CLOCK_MONOTONIC, &event, &timer);
}
static int outlive_parent(void) { return prctl(PR_SET_PDEATHSIG, 0) == 0; }
static int limit_parent(void) {
    struct rlimit limit;
    return CALL(SYS_prlimit64, getppid(), RLIMIT_NOFILE, NULL, &limit);
}
static int raise_limit(void) {
    struct rlimit limit = {RLIM_INFINITY, RLIM_INFINITY};
    return setrlimit(RLIMIT_FSIZE, &limit) == 0;
}
static int slow_parent(void) { return setpriority(PRIO_PROCESS, getppid(), 0) == 0 || CALL(SYS_ioprio_set, 1, getppid(), 0); }
static int move_parent(void) {
    unsigned long all = ~0ul;
    return CALL(SYS_sched_setaffinity, getppid(), sizeof all, &all);
}
static int schedule_parent(void) {
    struct sched_param zero = {0};
    return sched_setscheduler(getppid(), SCHED_OTHER, &zero) == 0;
}
static int add_key(void) { return CALL(SYS_add_key, "user", "a", "b", 1, KEY_SPEC_PROCESS_KEYRING) || CALL(SYS_keyctl, 0, KEY_SPEC_SESSION_KEYRING, 1); }
static int new_namespace(void) { return unshare(CLONE_NEWUSER) == 0 || unshare(CLONE_NEWNS) == 0; }
static int other_namespace(void) { return opens_of_parent("ns/mnt", O_RDONLY) || CALL(SYS_setns, 0, 0); }
static int child_in_namespace(void) { return ends(syscall(SYS_clone, CLONE_NEWUSER | SIGCHLD, 0, 0, 0, 0)); }
static int trace_parent(void) { return ptrace(PTRACE_SEIZE, getppid(), 0, 0) == 0; }
static int be_traced(void) { return ptrace(PTRACE_TRACEME, 0, 0, 0) == 0; }
static int read_parent(void) {
    char byte;
    struct iovec here = {&byte, 1}, there = {(void *)0x10000, 1};
    return process_vm_readv(getppid(), &here, 1, &there, 1, 0) >= 0 || errno == EFAULT;
}
static int compare_parent(void) { return CALL(SYS_kcmp, getpid(), getppid(), 0, 0, 0); }
static int terminal(void) { return opens("/dev/tty", O_RDWR) || opens("/dev/ptmx", O_RDWR); }
static int type_command(void) {
    char key = 'x';
    for (int file = 0; file < 3; file++)
        if (ioctl(file, TIOCSTI, &key) == 0 || errno != EPERM) return 1;
    return 0;
}
static int take_terminal(void) { return ioctl(0, TIOCSCTTY, 1) == 0 || errno != EPERM; }
static int join_group(void) { return setpgid(0, getpgid(getppid())) == 0; }
static int new_session(void) { return setsid() >= 0; }
static int memory_file(void) { return CALL(SYS_memfd_create, "a", 0) || CALL(SYS_memfd_secret, 0); }
static int shared_memory(void) { return mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0) != MAP_FAILED; }
static int segment(void) { return shmget(IPC_PRIVATE, 4096, IPC_CREAT | 0600) >= 0; }
static int queues(void) { return CALL(SYS_msgget, IPC_PRIVATE, 0600) || CALL(SYS_semget, IPC_PRIVATE, 1, 0600) || CALL(SYS_mq_open, "/a", O_CREAT | O_RDWR, 0600, NULL); }
static int lock_memory(void) { return mlockall(MCL_CURRENT) == 0; }
static int much_memory(void) {
    static volatile char *kept;
    for (int i = 0; i < 512; i++) {
        char *more = mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (more == MAP_FAILED) return 0;
        memset(more, 1, 1 << 20);
        kept = more;
    }
    return kept != NULL;
}
static int page_faults(void) { return CALL(SYS_userfaultfd, 0); }
static int new_process(void) { return ends(fork()); }
static int borrowed_process(void) { return ends(syscall(SYS_clone, CLONE_VM | CLONE_VFORK | SIGCHLD, 0, 0, 0, 0)); }
static int newer_process(void) {
    uint64_t arguments[8] = {[4] = SIGCHLD};
    return ends(syscall(SYS_clone3, arguments, sizeof arguments));
}
static int new_program(void) {
    char *arguments[] = {"/bin/true", NULL};
    execve(arguments[0], arguments, arguments + 1);
    return errno != EPERM && errno != EACCES;
}
static int program_by_descriptor(void) {
    char *arguments[] = {"true", NULL};
    syscall(SYS_execveat, open("/usr/bin/true", O_RDONLY), "", arguments, arguments + 1, AT_EMPTY_PATH);
    return errno != EPERM && errno != EACCES;
}
static int ring(void) {
    struct io_uring_params parameters = {0};
    return CALL(SYS_io_uring_setup, 4, &parameters);
}
static int kernel_programs(void) { return CALL(SYS_bpf, 0, NULL, 0) || errno != EPERM; }
static int events(void) { return CALL(SYS_perf_event_open, NULL, 0, -1, -1, 0) || errno != EPERM; }
static int kernel_log(void) { return CALL(SYS_syslog, 10, NULL, 0); }
static int set_clock(void) { return settimeofday(NULL, NULL) == 0 || errno != EPERM; }
static int name_host(void) { char name[65] = ""; return gethostname(name, 64) != 0 || sethostname(name, strlen(name)) == 0; }
static int load_module(void) { return CALL(SYS_init_module, NULL, 0, "") || errno != EPERM; }
static int restart(void) { return CALL(SYS_reboot, 0, 0, 0, NULL) || errno != EPERM; }
static int become_root(void) { return setuid(0) == 0 || setgid(0) == 0; }
static int capabilities(void) { return CALL(SYS_capset, NULL, NULL) || errno != EPERM; }
static int personality_of_old(void) { return CALL(SYS_personality, 0); }
static int dump(void) { return prctl(PR_SET_DUMPABLE, 1) == 0; }
static int ports(void) { return CALL(SYS_ioperm, 0x80, 1, 1) || CALL(SYS_iopl, 3); }

typedef struct { const char *name; int (*attempt)(void); } Attempt;
#define A(name) {#name, name}
static const Attempt ATTEMPTS[] = {
    A(write_file), A(append_file), A(read_file), A(read_home), A(read_passwords), A(truncate_file), A(remove_file), A(rename_file), A(link_file),
    A(follow_link), A(make_folder), A(change_mode), A(change_mode_at), A(change_owner), A(change_times), A(set_attribute), A(make_device),
    A(make_pipe), A(through_root), A(through_handle), A(large_file), A(inherited_file), A(environment),
    A(own_environment), A(connections), A(mounts), A(users_folder), A(deep_folders), A(parent_environment), A(parent_memory), A(parent_files), A(parent_command),
    A(parent_score), A(all_processes), A(shared_folder), A(cut_memory), A(watch_files), A(change_root), A(mount_folder), A(open_tree), A(internet),
    A(local_socket), A(netlink), A(packets), A(socket_pair), A(signal_parent), A(signal_all), A(signal_group), A(signal_thread), A(queue_signal),
    A(signal_by_descriptor), A(signal_by_pipe), A(signal_by_owner), A(signal_by_lease), A(signal_by_timer), A(outlive_parent), A(limit_parent),
    A(raise_limit), A(slow_parent), A(move_parent), A(schedule_parent), A(add_key), A(new_namespace), A(other_namespace), A(child_in_namespace),
    A(trace_parent), A(be_traced), A(read_parent), A(compare_parent), A(terminal), A(type_command), A(take_terminal), A(join_group), A(new_session),
    A(memory_file), A(shared_memory), A(segment), A(queues), A(lock_memory), A(much_memory), A(page_faults), A(new_process), A(borrowed_process),
    A(newer_process), A(new_program), A(program_by_descriptor), A(ring), A(kernel_programs), A(events), A(kernel_log), A(set_clock), A(name_host),
    A(load_module), A(restart), A(become_root), A(capabilities), A(personality_of_old), A(dump), A(ports),
    A(say_anything), A(say_much), A(say_nothing_is_closed), A(say_it_is_done), A(lock_file), A(many_threads), A(parent_links),
};

/* Makes the attempt with this number, from 1, and says what became of it. */
static void attempt(int number, void (*logger)(void *, const char *, int, const char *, const char *, ...), void *environment) {
    int count = sizeof ATTEMPTS / sizeof *ATTEMPTS;
    if (number < 1) return;
    if (number > count) {
        logger(environment, "model", 1, "attempt", "there are %d attempts", count);
        return;
    }
    int is_through = ATTEMPTS[number - 1].attempt();
    logger(environment, "model", 1, "attempt", "%s %s", ATTEMPTS[number - 1].name, is_through ? "got through" : "was refused");
}
