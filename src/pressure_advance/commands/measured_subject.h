// What a result is listed under.
#pragma once

#include <string>

#include "app/config/config_file.h"
#include "measurement/outcome.h"
#include "session/session.h"

namespace trammel::app {

/// The subject of what is measured on a printer now: as told, or as the printer and Spoolman have
/// it. What cannot be asked is left empty; standard error is told where that is the filament.
/// @param filament  empty: that of Spoolman's active spool
[[nodiscard]] measurement::Subject SubjectOf(const std::string& filament,
                                             const procedure::Session& session,
                                             const files::Config& config);

}  // namespace trammel::app
