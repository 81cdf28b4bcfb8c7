// Macros of a printer, klipper/trammel.cfg, as part of the program.
#pragma once

namespace trammel::service {

extern const char* const kMacros;

/// Macro that only the latest version of the file has.
inline constexpr const char* kLatestMacro = "_TRAMMEL_START";

}  // namespace trammel::service
