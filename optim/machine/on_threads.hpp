// Jobs in threads of this process, so many at a time: for simulations, which share nothing that changes.
//
//   on_threads(cases.size(), 2, [&](std::size_t c) { results[c] = evaluate(cases[c]); });
#pragma once

#include <cstddef>
#include <functional>

namespace mbsopt {

// Runs fewer at a time where the system has no further thread. Returns when all jobs have ended. Rethrows what the
// first of them has thrown, in the order of the jobs.
void on_threads(std::size_t jobs, int threads, const std::function<void(std::size_t job)>& work);

}  // namespace mbsopt
