// Input of a camera's calibration by a board, and the camera file it writes.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "part_alignment/board/board_calibration.h"

namespace trammel::files {

struct BoardFile {
  /// Measurement whose views have the names of their pictures, and no observations yet.
  part_alignment::BoardMeasurement measurement;
  std::string date;  ///< YYYY-MM-DD
  int bits = 14;     ///< bits per code on the sheet
};

/// Reads BOARD.json (docs/reference/formats.md). `sheet` is the path, relative to the file's
/// folder, of the output of `align targets --layout`: marks, radius of the discs, bits of the
/// codes. Errors (kInput) name file and place: not JSON, a key that is missing, unknown or out of
/// its range, a picture twice.
[[nodiscard]] Result<BoardFile> ReadBoardFile(const std::filesystem::path& path);

/// Reads a sheet alone, as BOARD.json names one: bits, layout and disc_radius_mm of the result.
/// Errors (kInput): as of ReadBoardFile.
[[nodiscard]] Result<BoardFile> ReadBoardSheet(const std::filesystem::path& path);

/// Writes a board file as text with a final newline; ReadBoardFile reads every number back to the
/// last bit.
/// @param sheet  path of the sheet's layout relative to the file's folder; empty: none
[[nodiscard]] std::string BoardFileText(const BoardFile& board, const std::string& sheet);

/// Writes the camera file of a good calibration, readable as any other, with the covariance.
[[nodiscard]] std::string CalibratedCameraText(const part_alignment::BoardCalibration& calibration,
                                               const std::string& date);

}  // namespace trammel::files
