// Counts every heap allocation of the process: malloc, calloc, realloc, aligned allocations, and so operator new and
// Eigen's own. Linking allocation_count.cpp is what switches it on.
//
//   const long before = allocation_count();
//   step(...);
//   CHECK(allocation_count() == before);
#pragma once

long allocation_count();
