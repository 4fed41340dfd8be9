// Jobs in a limited number of threads of this process: for simulations, which share only constant data.
//
//   on_threads(cases.size(), 2, [&](std::size_t c) { results[c] = evaluate(cases[c]); });
#pragma once

#include <cstddef>
#include <functional>

namespace mbsopt::inline optim {

// Runs fewer at a time if the system has no further thread. Returns when all jobs have ended. Then it rethrows the
// exception of the first job, in the order of the jobs, that threw one.
void on_threads(std::size_t jobs, int threads, const std::function<void(std::size_t job)>& work);

}  // namespace mbsopt::inline optim
