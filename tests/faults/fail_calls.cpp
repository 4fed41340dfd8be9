// A library to be loaded before all others (LD_PRELOAD): calls of the system that fail when they are told to.
//
//   FAIL_CALL=fdatasync FAIL_FROM=3 FAIL_COUNT=1 FAIL_ERRNO=28 mbsopt design ...
//
// fails the third call of fdatasync with errno 28. FAIL_COUNT=0: and all later ones. FAIL_ERRNO=0: the call is cut
// short (write and read take at most one byte). Calls before the program's first write to a regular file count, too.
// Each call that fails makes a line of FAIL_LOG longer by one byte: whether there was one.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<long> calls = 0;

long number(const char* name) {
  const char* const text = std::getenv(name);
  return text ? std::atol(text) : 0;
}

template <class Function>
Function original(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

// Whether this call is one that fails.
bool fails(const char* name) {
  const char* const chosen = std::getenv("FAIL_CALL");
  if (!chosen || std::strcmp(chosen, name) != 0) return false;
  const long call = ++calls, from = number("FAIL_FROM"), count = number("FAIL_COUNT");
  if (call < from || (count > 0 && call >= from + count)) return false;
  if (const char* const log = std::getenv("FAIL_LOG")) {
    const int file = original<int (*)(const char*, int, ...)>("open")(log, O_WRONLY | O_CREAT | O_APPEND, 0666);
    [[maybe_unused]] const ssize_t told = original<ssize_t (*)(int, const void*, std::size_t)>("write")(file, "x", 1);
    ::close(file);
  }
  errno = static_cast<int>(number("FAIL_ERRNO"));
  return true;
}

bool is_regular(int file) {
  struct stat what = {};
  return ::fstat(file, &what) == 0 && S_ISREG(what.st_mode);
}

}  // namespace

// Output to regular files; what goes to pipes and terminals is left alone.
extern "C" ssize_t write(int file, const void* data, std::size_t size) {
  const auto write_to = original<ssize_t (*)(int, const void*, std::size_t)>("write");
  if (size == 0 || !is_regular(file) || !fails("write")) return write_to(file, data, size);
  return errno == 0 ? write_to(file, data, 1) : -1;
}

extern "C" ssize_t read(int file, void* data, std::size_t size) {
  const auto read_from = original<ssize_t (*)(int, void*, std::size_t)>("read");
  if (size == 0 || !is_regular(file) || !fails("read")) return read_from(file, data, size);
  return errno == 0 ? read_from(file, data, 1) : -1;
}

extern "C" int open(const char* path, int flags, ...) {
  std::va_list more;
  va_start(more, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  if (flags & O_CREAT ? fails("create") : flags & (O_WRONLY | O_RDWR) && fails("open")) return -1;
  return original<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

extern "C" int fsync(int file) { return fails("fsync") ? -1 : original<int (*)(int)>("fsync")(file); }
extern "C" int fdatasync(int file) { return fails("fdatasync") ? -1 : original<int (*)(int)>("fdatasync")(file); }
extern "C" int ftruncate(int file, off_t size) noexcept {
  return fails("ftruncate") ? -1 : original<int (*)(int, off_t)>("ftruncate")(file, size);
}
extern "C" int rename(const char* from, const char* to) noexcept {
  return fails("rename") ? -1 : original<int (*)(const char*, const char*)>("rename")(from, to);
}
extern "C" pid_t fork() noexcept { return fails("fork") ? -1 : original<pid_t (*)()>("fork")(); }
extern "C" int pipe2(int* ends, int flags) noexcept {
  return fails("pipe2") ? -1 : original<int (*)(int*, int)>("pipe2")(ends, flags);
}
