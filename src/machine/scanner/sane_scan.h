// What the process with the scanner's driver does, and the messages in which it tells of it.
#pragma once

#include <cstdint>

#include "machine/net/child_process.h"
#include "machine/scanner/scanner.h"

namespace trammel::machine {

/// ChildMessage::kind.
enum class ScannerMessage : std::uint32_t {
  kScanner,  ///< One that there is: name, vendor, model and kind, each with a 0 at its end.
  kChosen,   ///< The name of the scanner that is being opened.
  kFrame,    ///< FrameHead: what follows is of this shape.
  kSamples,  ///< Of a frame, in the order in which they came.
  kFrameEnd,
  kDone,   ///< All is said. A double: the resolution, or 0 where nothing was scanned.
  kError,  ///< All is said. The ErrorKind as one byte, then the message.
};

struct FrameHead {
  /// The same for all three where one pass makes the whole picture.
  enum class Colors : std::int32_t { kGrey, kRgb, kRed, kGreen, kBlue };
  Colors colors = Colors::kGrey;
  std::int32_t width_px = 0;
  std::int32_t lines = 0;  ///< < 1: not known
  std::int32_t bytes_per_line = 0;
  std::int32_t bits = 0;
  std::int32_t last = 1;  ///< 0: another one follows
};

/// Both end with kDone or kError, and may do the scanner good after it.
void ListInChild(const ChildSender& sender);
void ScanInChild(const ScanRequest& request, const ChildSender& sender);

}  // namespace trammel::machine
