#include "session/name_stop.h"

namespace trammel::procedure {

Error NameStop(const std::stop_token& stop, Error error) {
  if (!stop.stop_requested() || error.kind == ErrorKind::kInterrupted) return error;
  return {ErrorKind::kInterrupted,
          "stopped by the user; what failed meanwhile: " + std::move(error.message)};
}

}  // namespace trammel::procedure
