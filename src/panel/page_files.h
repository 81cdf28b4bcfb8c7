// The panel's page, compressed and built into the program.
#pragma once

#include <cstddef>
#include <span>

namespace trammel::panel {

struct PageFile {
  const char* path;            ///< "/panel.js"
  const char* content_type;    ///< with the character set
  const char* hash;            ///< of the content, for ETag
  const unsigned char* bytes;  ///< gzip
  std::size_t size;
};

[[nodiscard]] std::span<const PageFile> PageFiles();

}  // namespace trammel::panel
