// Files that the printer's owner uploaded: the folder beside its configuration, as front ends list
// it.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "session/session.h"

namespace trammel::procedure {

/// The folder's name beside the printer's configuration.
inline constexpr const char* kUploadFolder = "trammel";

struct UploadedFile {
  std::string name;       ///< without a folder
  double modified_s = 0;  ///< seconds since 1970 by the printer's clock; 0: not told
};

/// Lists the folder's own files, not those of folders in it, whose names are wanted; the one that
/// was stored last comes last. Errors: kMachine.
[[nodiscard]] Result<std::vector<UploadedFile>> ListUploads(
    const Session& session, const std::function<bool(const std::string&)>& wanted);

/// Downloads one of them. Errors: kInput: there is none of that name, it has more bytes, or a name
/// that no server can be asked for; kMachine.
[[nodiscard]] Result<std::string> DownloadUpload(const Session& session, const std::string& name,
                                                 std::size_t most_bytes);

/// What a file's name ends in, in small letters with the dot, where it is one of `endings`; empty
/// otherwise, and of a name with a folder or of nothing but an ending.
[[nodiscard]] std::string EndingAmong(std::span<const std::string_view> endings,
                                      const std::string& name);

}  // namespace trammel::procedure
