// Files uploaded by the printer's owner: the folder beside its configuration, as listed by front
// ends.
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

/// Name of the folder beside the printer's configuration.
inline constexpr const char* kUploadFolder = "trammel";

struct UploadedFile {
  std::string name;       ///< without a folder
  double modified_s = 0;  ///< seconds since 1970 by the printer's clock; 0: not told
};

/// Lists the folder's own files with wanted names, not those of subfolders; the last stored is
/// last. Errors: kMachine.
[[nodiscard]] Result<std::vector<UploadedFile>> ListUploads(
    const Session& session, const std::function<bool(const std::string&)>& wanted);

/// Downloads one of them. Errors: kInput: no such file, more bytes, or a name invalid for servers;
/// kMachine.
[[nodiscard]] Result<std::string> DownloadUpload(const Session& session, const std::string& name,
                                                 std::size_t max_bytes);

/// Returns a file name's extension, in lower case with the dot, if it is one of `endings`; empty
/// otherwise, for a name with a folder, and for a mere extension.
[[nodiscard]] std::string EndingAmong(std::span<const std::string_view> endings,
                                      const std::string& name);

}  // namespace trammel::procedure
