// What a result is listed under.
#pragma once

#include <optional>
#include <string>

#include "app/config/config_file.h"
#include "base/result.h"
#include "machine/moonraker/spoolman.h"
#include "measurement/outcome.h"
#include "session/session.h"

namespace trammel::app {

/// Whether two names can be of one filament: one of them has to hold the other, as "PETG Jet" and
/// "Prusament PETG-Jet" do. An empty one, and one that no key can be made of, can be any.
[[nodiscard]] bool MayBeSameFilament(const std::string& a, const std::string& b);

/// Checks the name that --filament gives; an empty one is none. Errors: those of FilamentKey, with
/// the option's name.
[[nodiscard]] Result<void> CheckFilamentOption(const std::string& name);

/// The spool on the printer; none, too, where Spoolman does not tell.
/// @param wanted  standard error is told why it does not
[[nodiscard]] std::optional<machine::Spool> SpoolNow(const procedure::Session& session,
                                                     bool wanted);

/// The subject of what is measured on a printer: as told, or as the printer and Spoolman have it.
/// What cannot be asked is left empty.
/// @param filament  empty: that of the spool
[[nodiscard]] measurement::Subject SubjectOf(const std::string& filament,
                                             const procedure::Session& session,
                                             const files::Config& config,
                                             const std::optional<machine::Spool>& spool);

}  // namespace trammel::app
