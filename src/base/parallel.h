// Independent pieces of work on all processors.
#pragma once

#include <functional>
#include <limits>

namespace trammel {

/// Calls work(0) … work(count - 1), begun in this order, on as many threads as there are
/// processors, or fewer. The pieces must not touch each other's results. After an exception no
/// further piece is begun, and the first is thrown on.
/// @param most_threads  >= 1; the caller's own is one of them.
void ParallelFor(int count, const std::function<void(int)>& work,
                 int most_threads = std::numeric_limits<int>::max());

}  // namespace trammel
