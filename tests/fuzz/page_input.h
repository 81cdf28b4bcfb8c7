// Reads an input as a file of scanned pages.
#pragma once

#include <string>

#include "fuzz.h"
#include "machine/page/page_file.h"
#include "memory_file.h"

namespace trammel::fuzz {

/// Every page that is read has a size and all its samples.
inline void ReadAsPages(const MemoryFile& file, std::string_view bytes) {
  file.Write(bytes);
  const auto pages = machine::ReadPages(file.path());
  if (!Good(pages)) return;
  Require(!pages->empty(), "a file that can be read has a page");
  for (const Page& page : *pages) {
    Require(page.width >= 1 && page.height >= 1, "a page has a size");
    Require(page.samples.size() ==
                static_cast<std::size_t>(page.stride()) * static_cast<std::size_t>(page.height),
            "a page has all its samples");
  }
}

}  // namespace trammel::fuzz
