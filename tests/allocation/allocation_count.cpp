#include "tests/allocation/allocation_count.hpp"

#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

namespace {

std::atomic<long> count{0}, bytes{0}, most{0};

void add_bytes(std::size_t size) {
  const long now = bytes += static_cast<long>(size);
  long before = most.load();
  while (now > before && !most.compare_exchange_weak(before, now)) {
  }
}
void remove_bytes(std::size_t size) { bytes -= static_cast<long>(size); }

}  // namespace

long allocation_count() { return count.load(); }
long allocated_bytes() { return bytes.load(); }
long most_allocated_bytes() { return most.load(); }
void restart_most_allocated() { most = bytes.load(); }

#if defined(__SANITIZE_ADDRESS__)

// The sanitizer has replaced malloc already; it calls whoever asks.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void*, std::size_t),
                                                         void (*)(const volatile void*));
extern "C" std::size_t __sanitizer_get_allocated_size(const volatile void*);
namespace {

[[maybe_unused]] const int installed = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t size) {
      ++count;
      add_bytes(size);
    },
    [](const volatile void* block) { remove_bytes(__sanitizer_get_allocated_size(block)); });

}  // namespace

#else

// glibc's own entry points under the names that may be replaced (its manual, "Replacing malloc").
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

namespace {

std::size_t size_of(void* block) { return block ? malloc_usable_size(block) + sizeof(std::size_t) : 0; }

void* counted(void* block) {
  ++count;
  add_bytes(size_of(block));
  return block;
}

}  // namespace

extern "C" {
void* malloc(std::size_t size) { return counted(__libc_malloc(size)); }
void* calloc(std::size_t number, std::size_t size) { return counted(__libc_calloc(number, size)); }
void* realloc(void* block, std::size_t size) {
  remove_bytes(size_of(block));
  return counted(__libc_realloc(block, size));
}
void* memalign(std::size_t alignment, std::size_t size) { return counted(__libc_memalign(alignment, size)); }
void* aligned_alloc(std::size_t alignment, std::size_t size) { return counted(__libc_memalign(alignment, size)); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = counted(__libc_memalign(alignment, size));
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) {
  remove_bytes(size_of(block));
  __libc_free(block);
}
}

#endif
