// Independent pieces of work on all processors.
#pragma once

#include <functional>

namespace trammel::tool_offset {

/// Calls work(0) … work(count - 1), in no particular order, on as many threads as there are
/// processors. The pieces must not touch each other's results. The first exception is thrown on.
void ParallelFor(int count, const std::function<void(int)>& work);

}  // namespace trammel::tool_offset
