// Counts every heap allocation of the process: malloc, calloc, realloc, aligned allocations, and so operator new and
// Eigen's own. Linking allocation_count.cpp is what switches it on.
//
//   const long before = allocation_count();
//   step(...);
//   CHECK(allocation_count() == before);
#pragma once

long allocation_count();

// What is allocated and not freed [bytes], with the heap's own overhead as far as it is per block; its largest value
// since the last call of restart_most_allocated().
long allocated_bytes();
long most_allocated_bytes();
void restart_most_allocated();
