// Pictures of results, where front ends show them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/printer.h"

namespace trammel::service {

/// Beside printer.cfg, as front ends list it.
inline constexpr std::string_view kPictureFolder = "trammel";
/// In the folder of a run: the figure that shows its answer.
inline constexpr const char* kAnswerPicture = "answer.png";
inline constexpr std::size_t kMostPictures = 20;
inline constexpr std::size_t kMostPictureBytes = std::size_t{4} << 20;

/// Stores a run's picture, and removes the oldest of more than kMostPictures: only files with such
/// a name (run and ".png"). Where they cannot be listed or removed the picture stays, too.
/// @param run  its id. @param png  at most kMostPictureBytes.
/// Errors: kMachine: not stored; kInput: too large.
[[nodiscard]] Result<void> StorePicture(machine::Printer& printer, const std::string& run,
                                        std::string_view png, const machine::WaitLimit& limit);

/// Whether a name can be that of a run's picture.
[[nodiscard]] bool IsResultPicture(const std::string& name);

}  // namespace trammel::service
