// What a camera's calibration by a board reads, and the camera file it leaves.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "part_alignment/board/board_calibration.h"

namespace trammel::files {

struct BoardFile {
  /// Views have the names of their pictures, and no observations yet.
  part_alignment::BoardMeasurement measurement;
  std::string date;  ///< YYYY-MM-DD
  int bits = 14;     ///< of the sheet's codes
};

/// BOARD.json (docs/reference/formats.md). `sheet` names what `align targets --layout` left, from
/// the file's folder: its marks, the radius of its discs, the bits of its codes. Errors (kInput)
/// name file and place: not JSON, a key that is missing, unknown or out of its range, a picture
/// twice.
[[nodiscard]] Result<BoardFile> ReadBoardFile(const std::filesystem::path& path);

/// A sheet alone, as BOARD.json names one: bits, layout and disc_radius_mm of the result.
/// Errors (kInput): as of ReadBoardFile.
[[nodiscard]] Result<BoardFile> ReadBoardSheet(const std::filesystem::path& path);

/// The same as text, ended by a newline; ReadBoardFile gives every number back to the last bit.
/// @param sheet  path of the sheet's layout from the file's folder; empty: none
[[nodiscard]] std::string BoardFileText(const BoardFile& board, const std::string& sheet);

/// The camera file of a good calibration: readable as any other, with the covariance beside.
[[nodiscard]] std::string CalibratedCameraText(const part_alignment::BoardCalibration& calibration,
                                               const std::string& date);

}  // namespace trammel::files
