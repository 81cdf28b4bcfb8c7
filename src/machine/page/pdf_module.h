// trammel-pdf.so: extracts the pictures on a PDF's pages, by qpdf, which depends on GnuTLS. It runs
// in a child process, since only a process limit bounds what the library unpacks internally.
#pragma once

#include <cstdint>
#include <filesystem>
#include <type_traits>

#include "base/result.h"
#include "machine/net/child_process.h"
#include "machine/page/page_decoders.h"

namespace trammel::machine {

/// Header of a page, before the bytes of its picture.
struct PdfPicture {
  PageLayout layout;      ///< unpacked rows; undefined for a JPEG
  double max_packed = 1;  ///< highest compression ratio of the packing
  bool jpeg = false;
  double width_pt = 0;    ///< drawn width, along its rows
  double height_pt = 0;   ///< and across
  bool mirrored = false;  ///< true if stored from the last row to the first
};
static_assert(std::is_trivially_copyable_v<PdfPicture>);

/// Kinds of messages: a PdfPicture, pieces of its bytes, the ends of page and file, or in their
/// place the file's fault.
enum PdfMessage : std::uint32_t {
  kPdfPicture = 1,
  kPdfBytes,
  kPdfPageEnds,
  kPdfFileEnds,
  kPdfFault,
};

struct PdfModule {
  /// Sends each page of a file: a PdfPicture, its bytes (unpacked rows as stored; of a JPEG the
  /// file) and kPdfPageEnds. Stops when `sender` accepts no more. Errors: the file's fault, in
  /// words for its owner.
  /// @param most_bytes  of memory, limited by the caller; for the message
  Result<void> (*send_pages)(const std::filesystem::path& path, std::uint64_t file_bytes,
                             std::uint64_t max_bytes, const PageReadOptions& options,
                             const ChildSender& sender);
};

/// Returns the module's function table. Errors (kInput): those of LoadModule.
[[nodiscard]] Result<const PdfModule*> FindPdfModule();

}  // namespace trammel::machine
