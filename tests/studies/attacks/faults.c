/* Lets a call on files of one folder fail: preloaded, and armed by `faults_arm`.
 *
 * Calls of each kind are counted in a page that processes share. The call of a number, or
 * each from that number on, fails with an error, or transfers half of what it could.
 * numpy.fromfile calls fread, whose own read cannot be replaced: so fread fails here.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

enum kind { WRITE, SYNC, RENAME, OPEN, READ, TRUNCATE, LINK, UNLINK, KINDS };

struct page {
    long kind, number, onward, error; /* an error of 0: half is transferred */
    long calls[KINDS];
    long failed;
    char folder[PATH_MAX];
};

static struct page *page;

void faults_arm(struct page *shared) { page = shared; }

static int is_inside(const char *path)
{
    size_t length = strlen(page->folder);
    return path[0] != '/' ||
           (!strncmp(path, page->folder, length) && (path[length] == '/' || !path[length]));
}

static int is_inside_fd(int fd)
{
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0)
        return 0;
    path[length] = 0;
    return path[0] == '/' && is_inside(path);
}

static int is_next(enum kind kind)
{
    long number = __sync_add_and_fetch(&page->calls[kind], 1);
    int due = number == page->number || (page->onward && number > page->number);
    if (kind != page->kind || page->number < 1 || !due)
        return 0;
    page->failed++;
    errno = (int)page->error;
    return 1;
}

static int fails(enum kind kind, const char *path)
{
    return page && path && is_inside(path) && is_next(kind);
}

static int fails_fd(enum kind kind, int fd)
{
    int before = errno, failing = page && is_inside_fd(fd) && is_next(kind);
    if (!failing)
        errno = before;
    return failing;
}

#define NEXT(name)                                                                     \
    static __typeof__(&name) next;                                                     \
    if (!next)                                                                         \
    next = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

/* on a fault: an error, or a call for half as much */
#define TRANSFER(kind, fd, size)                                                       \
    if (fails_fd(kind, fd)) {                                                          \
        if (page->error || size < 2)                                                   \
            return errno = page->error ? (int)page->error : EIO, -1;                   \
        size /= 2;                                                                     \
    }

ssize_t write(int fd, const void *data, size_t size)
{
    NEXT(write);
    TRANSFER(WRITE, fd, size)
    return next(fd, data, size);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t at)
{
    NEXT(pwrite);
    TRANSFER(WRITE, fd, size)
    return next(fd, data, size, at);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at)
{
    NEXT(pwrite64);
    TRANSFER(WRITE, fd, size)
    return next(fd, data, size, at);
}

ssize_t read(int fd, void *data, size_t size)
{
    NEXT(read);
    TRANSFER(READ, fd, size)
    return next(fd, data, size);
}

ssize_t pread(int fd, void *data, size_t size, off_t at)
{
    NEXT(pread);
    TRANSFER(READ, fd, size)
    return next(fd, data, size, at);
}

ssize_t pread64(int fd, void *data, size_t size, off64_t at)
{
    NEXT(pread64);
    TRANSFER(READ, fd, size)
    return next(fd, data, size, at);
}

size_t fread(void *data, size_t size, size_t count, FILE *file)
{
    NEXT(fread);
    if (fails_fd(READ, fileno(file))) {
        if (page->error)
            return 0;
        count /= 2;
    }
    return next(data, size, count, file);
}

#define SYNCING(name)                                                                  \
    int name(int fd)                                                                   \
    {                                                                                  \
        NEXT(name);                                                                    \
        return fails_fd(SYNC, fd) ? -1 : next(fd);                                     \
    }
SYNCING(fsync)
SYNCING(fdatasync)

#define OPENING(name)                                                                  \
    int name(const char *path, int flags, ...)                                         \
    {                                                                                  \
        NEXT(name);                                                                    \
        va_list rest;                                                                  \
        va_start(rest, flags);                                                         \
        mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, mode_t) : 0;      \
        va_end(rest);                                                                  \
        return fails(OPEN, path) ? -1 : next(path, flags, mode);                       \
    }
OPENING(open)
OPENING(open64)

#define OPENING_AT(name)                                                               \
    int name(int folder, const char *path, int flags, ...)                             \
    {                                                                                  \
        NEXT(name);                                                                    \
        va_list rest;                                                                  \
        va_start(rest, flags);                                                         \
        mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, mode_t) : 0;      \
        va_end(rest);                                                                  \
        return fails(OPEN, path) ? -1 : next(folder, path, flags, mode);               \
    }
OPENING_AT(openat)
OPENING_AT(openat64)

DIR *opendir(const char *path)
{
    NEXT(opendir);
    return fails(OPEN, path) ? NULL : next(path);
}

int rename(const char *from, const char *to)
{
    NEXT(rename);
    return fails(RENAME, from) ? -1 : next(from, to);
}

int renameat(int folder, const char *from, int other, const char *to)
{
    NEXT(renameat);
    return fails(RENAME, from) ? -1 : next(folder, from, other, to);
}

int link(const char *from, const char *to)
{
    NEXT(link);
    return fails(LINK, from) ? -1 : next(from, to);
}

int linkat(int folder, const char *from, int other, const char *to, int flags)
{
    NEXT(linkat);
    return fails(LINK, from) ? -1 : next(folder, from, other, to, flags);
}

int unlink(const char *path)
{
    NEXT(unlink);
    return fails(UNLINK, path) ? -1 : next(path);
}

int unlinkat(int folder, const char *path, int flags)
{
    NEXT(unlinkat);
    return fails(UNLINK, path) ? -1 : next(folder, path, flags);
}

int ftruncate(int fd, off_t size)
{
    NEXT(ftruncate);
    return fails_fd(TRUNCATE, fd) ? -1 : next(fd, size);
}

int ftruncate64(int fd, off64_t size)
{
    NEXT(ftruncate64);
    return fails_fd(TRUNCATE, fd) ? -1 : next(fd, size);
}
