// A photo of the printed pattern, from where its owner left it.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "base/result.h"
#include "session/session.h"
#include "session/uploads.h"

namespace trammel::procedure {

inline constexpr std::size_t kMostPhotoBytes = std::size_t{64} << 20;

struct PatternPhoto {
  std::string name;  ///< of the file, without a folder
  std::string bytes;
  /// When the file was stored, by ServerTime_s' clock; absent where it was named, or not told.
  std::optional<double> stored_s = {};
};

/// The clock by which the printer's server dates its files, s since 1970, at most some two seconds
/// late; absent where it is not told.
[[nodiscard]] std::optional<double> ServerTime_s(const Session& session);

/// Downloads a photo from the folder beside the printer's configuration.
/// @param name  in it; empty: the picture (JPEG, PNG, WebP, HEIC) that was stored last
/// @param is_result  whether a name is that of a result's picture, which is no photo
/// Errors: kInput: there is none, or it is larger than kMostPhotoBytes; kMachine.
[[nodiscard]] Result<PatternPhoto> DownloadPhoto(
    const Session& session, const std::string& name,
    const std::function<bool(const std::string&)>& is_result);

/// What a file's name ends in, in small letters with the dot; empty: not that of a picture.
[[nodiscard]] std::string PictureEnding(const std::string& name);

}  // namespace trammel::procedure
