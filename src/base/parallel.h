// Runs independent tasks on all processors.
#pragma once

#include <functional>
#include <limits>

namespace trammel {

/// Calls work(0) … work(count - 1), started in this order, on at most as many threads as there are
/// processors. Tasks must not share results. After an exception no further task starts, and the
/// first exception is rethrown.
/// @param most_threads  >= 1; includes the caller's own.
void ParallelFor(int count, const std::function<void(int)>& work,
                 int max_threads = std::numeric_limits<int>::max());

}  // namespace trammel
