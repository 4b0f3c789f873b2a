/* Loaded before the C library (LD_PRELOAD), makes file operations below one folder fail as a dying disk or a full one
 * does. tests/src/faults.rs compiles it and sets the environment:
 *
 *   FAULT_UNDER  the folder, an absolute path
 *   FAULT_CALLS  "changes": opening for writing, write, pwrite, fsync, fdatasync, sync_file_range, ftruncate, rename,
 *                link, mkdir, unlink; or "reads": opening for reading, read, pread
 *   FAULT_AT     which of these calls fails, counted from 1 over all threads; 0: none, they are only counted
 *   FAULT_ERRNO  with which error number
 *   FAULT_LASTS  "once", or "on": all later ones fail too
 *   FAULT_LOG    a file outside the folder: a line for each call that failed; with FAULT_AT=0 a line for each call
 *
 * A write that fails has written half its bytes: errors do not come between writes only. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_ulong calls;
static const char *under, *log_path;
static unsigned long at;
static int fault_errno, lasts, reads;

__attribute__((constructor)) static void begin(void) {
    const char *text;
    under = getenv("FAULT_UNDER");
    log_path = getenv("FAULT_LOG");
    at = (text = getenv("FAULT_AT")) ? strtoul(text, NULL, 10) : 0;
    fault_errno = (text = getenv("FAULT_ERRNO")) ? atoi(text) : EIO;
    lasts = (text = getenv("FAULT_LASTS")) && strcmp(text, "on") == 0;
    reads = (text = getenv("FAULT_CALLS")) && strcmp(text, "reads") == 0;
}

static int is_below(const char *path) {
    size_t length = under ? strlen(under) : 0;
    return length > 0 && path && strncmp(path, under, length) == 0 && (path[length] == '/' || path[length] == 0);
}

/* One line in one write, by system calls: they are not counted. */
static void note(unsigned long number, const char *call, const char *path) {
    char line[PATH_MAX + 64];
    int length = snprintf(line, sizeof line, "%lu %s %s\n", number, call, path);
    long file = syscall(SYS_openat, AT_FDCWD, log_path, O_WRONLY | O_CREAT | O_APPEND, 0644);
    if (file >= 0) {
        syscall(SYS_write, file, line, length);
        syscall(SYS_close, file);
    }
}

/* Whether this call on this path has to fail. */
static int fails(const char *call, const char *path, int is_read) {
    if (is_read != reads || !is_below(path))
        return 0;
    unsigned long number = atomic_fetch_add(&calls, 1) + 1;
    int hit = at > 0 && (number == at || (lasts && number > at));
    if (log_path && (hit || at == 0))
        note(number, call, path);
    return hit;
}

static int fails_on(const char *call, int file, int is_read) {
    char link[64], path[PATH_MAX];
    if (is_read != reads)
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    long length = syscall(SYS_readlinkat, AT_FDCWD, link, path, sizeof path - 1);
    if (length <= 0)
        return 0;
    path[length] = 0;
    return fails(call, path, is_read);
}

static int failed(void) {
    errno = fault_errno;
    return -1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int open_fails(const char *path, int flags) {
    int writes = (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT);
    return fails(writes ? "open-for-writing" : "open-for-reading", path, !writes);
}

static mode_t mode_of(int flags, va_list rest) {
    return (flags & (O_CREAT | O_TMPFILE)) ? va_arg(rest, mode_t) : 0;
}

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...) {                                                                      \
        va_list rest;                                                                                                  \
        va_start(rest, flags);                                                                                         \
        mode_t mode = mode_of(flags, rest);                                                                            \
        va_end(rest);                                                                                                  \
        return open_fails(path, flags) ? failed() : REAL(name)(path, flags, mode);                                     \
    }
OPEN(open)
OPEN(open64)

ssize_t write(int file, const void *bytes, size_t count) {
    if (!fails_on("write", file, 0))
        return REAL(write)(file, bytes, count);
    if (count > 1)
        REAL(write)(file, bytes, count / 2);
    return failed();
}

ssize_t writev(int file, const struct iovec *parts, int count) {
    return fails_on("write", file, 0) ? failed() : REAL(writev)(file, parts, count);
}

ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t offset) {
    if (!fails_on("pwrite", file, 0))
        return REAL(pwrite64)(file, bytes, count, offset);
    if (count > 1)
        REAL(pwrite64)(file, bytes, count / 2, offset);
    return failed();
}

ssize_t read(int file, void *bytes, size_t count) {
    return fails_on("read", file, 1) ? failed() : REAL(read)(file, bytes, count);
}

ssize_t pread64(int file, void *bytes, size_t count, off64_t offset) {
    return fails_on("pread", file, 1) ? failed() : REAL(pread64)(file, bytes, count, offset);
}

int fsync(int file) { return fails_on("fsync", file, 0) ? failed() : REAL(fsync)(file); }

int fdatasync(int file) { return fails_on("fdatasync", file, 0) ? failed() : REAL(fdatasync)(file); }

int sync_file_range(int file, off64_t offset, off64_t count, unsigned flags) {
    return fails_on("sync_file_range", file, 0) ? failed() : REAL(sync_file_range)(file, offset, count, flags);
}

int ftruncate64(int file, off64_t length) {
    return fails_on("ftruncate", file, 0) ? failed() : REAL(ftruncate64)(file, length);
}

int rename(const char *from, const char *to) { return fails("rename", from, 0) ? failed() : REAL(rename)(from, to); }

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags) {
    return fails("link", to, 0) ? failed() : REAL(linkat)(from_folder, from, to_folder, to, flags);
}

int mkdir(const char *path, mode_t mode) { return fails("mkdir", path, 0) ? failed() : REAL(mkdir)(path, mode); }

int unlink(const char *path) { return fails("unlink", path, 0) ? failed() : REAL(unlink)(path); }

/* Removing a folder goes through its descriptor. */
int unlinkat(int folder, const char *name, int flags) {
    return fails_on("unlink", folder, 0) ? failed() : REAL(unlinkat)(folder, name, flags);
}
