// trammel-pdf.so: the pictures on a PDF's pages, by qpdf, which brings GnuTLS along. It works in a
// child, as nothing bounds what the library unpacks for itself but the process that it is in.
#pragma once

#include <cstdint>
#include <filesystem>
#include <type_traits>

#include "base/result.h"
#include "machine/net/child_process.h"
#include "machine/page/page_decoders.h"

namespace trammel::machine {

/// What is told of a page, before the bytes of its picture.
struct PdfPicture {
  PageLayout layout;       ///< of the unpacked rows; without meaning for a JPEG
  double most_packed = 1;  ///< by what the picture's packing can make it smaller at best
  bool jpeg = false;
  double width_pt = 0;    ///< as the page draws it, along its rows
  double height_pt = 0;   ///< and across
  bool mirrored = false;  ///< as stored: its rows come from the last to the first
};
static_assert(std::is_trivially_copyable_v<PdfPicture>);

/// Kinds of messages: a PdfPicture, pieces of its bytes, the ends of page and file, and in its
/// place what is wrong with the file.
enum PdfMessage : std::uint32_t {
  kPdfPicture = 1,
  kPdfBytes,
  kPdfPageEnds,
  kPdfFileEnds,
  kPdfFault,
};

struct PdfModule {
  /// Sends each page of a file: a PdfPicture, its bytes (rows as stored, unpacked; of a JPEG the
  /// file) and kPdfPageEnds. Stops where `sender` takes no more. Errors: what is wrong with the
  /// file, in words for its owner.
  /// @param most_bytes  of memory, which the caller limits; for the message
  Result<void> (*send_pages)(const std::filesystem::path& path, std::uint64_t file_bytes,
                             std::uint64_t most_bytes, const PageReadOptions& options,
                             const ChildSender& sender);
};

/// The module's table. Errors (kInput): those of LoadModule.
[[nodiscard]] Result<const PdfModule*> FindPdfModule();

}  // namespace trammel::machine
