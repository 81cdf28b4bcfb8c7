// Forms with files, as browsers and slicers upload them, and their checksum.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::sim {

struct FormPart {
  std::string name;
  std::string filename;  ///< empty where the part is no file
  std::string body;
};

/// Takes a multipart/form-data body apart. Errors (kInput): another content type, no boundary, a
/// body that is not closed, more than 100 parts.
[[nodiscard]] Result<std::vector<FormPart>> ParseMultipart(std::string_view content_type,
                                                           std::string_view body);

/// In lower-case hexadecimal.
[[nodiscard]] std::string Sha256(std::string_view data);

}  // namespace trammel::sim
