// The user's stop comes before whatever failed after it.
#pragma once

#include <stop_token>
#include <utility>

#include "base/result.h"

namespace trammel::procedure {

/// Names the stop that the user asked for as what ended the work, and the failure as what came with
/// it: Ctrl-C and a closed terminal reach a tunnel or a camera's server of the same terminal, too.
/// To be called where something has just failed; before any stop, the error is returned as it is.
[[nodiscard]] Error NameStop(const std::stop_token& stop, Error error);

/// The same for what may have succeeded.
template <class T>
[[nodiscard]] Result<T> NameStop(const std::stop_token& stop, Result<T> done) {
  if (done) return done;
  return tl::unexpected(NameStop(stop, std::move(done.error())));
}

}  // namespace trammel::procedure
