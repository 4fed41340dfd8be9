#include "tests/allocation/allocation_count.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>

namespace {

std::atomic<long> count{0};

}  // namespace

long allocation_count() { return count.load(); }

#if defined(__SANITIZE_ADDRESS__)

// The sanitizer has replaced malloc already; it calls whoever asks.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void*, std::size_t),
                                                         void (*)(const volatile void*));
namespace {

[[maybe_unused]] const int installed = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { ++count; }, [](const volatile void*) {});

}  // namespace

#else

// glibc's own entry points under the names that may be replaced (its manual, "Replacing malloc").
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) { return ++count, __libc_malloc(size); }
void* calloc(std::size_t number, std::size_t size) { return ++count, __libc_calloc(number, size); }
void* realloc(void* block, std::size_t size) { return ++count, __libc_realloc(block, size); }
void* memalign(std::size_t alignment, std::size_t size) { return ++count, __libc_memalign(alignment, size); }
void* aligned_alloc(std::size_t alignment, std::size_t size) { return ++count, __libc_memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = (++count, __libc_memalign(alignment, size));
  return *block == nullptr ? ENOMEM : 0;
}
}

#endif
