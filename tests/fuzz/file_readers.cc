// Targets that only read a file: whatever it has, there is a value or an error fit to be read.
#include <filesystem>

#include "fuzz.h"
#include "memory_file.h"
#include "page_input.h"
#include "part_alignment/files/alignment_result.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/files/budget_file.h"
#include "part_alignment/files/calibration_grid_file.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/stl_file.h"
#include "part_alignment/files/survey_file.h"
#include "pressure_advance/files/pattern_prints.h"
#include "tool_offset/files/offset_file.h"
#include "tool_offset/files/offset_history.h"
#include "tool_offset/files/start_file.h"

namespace trammel::fuzz {
namespace {

template <class Read>
int ReadFile(const MemoryFile& file, const std::uint8_t* data, std::size_t size, Read read) {
  file.Write(Text(data, size));
  (void)Good(read(file.path()));
  return 0;
}

// FILE_TARGET(name, file's name, expression of its `path`)
#define FILE_TARGET(target, name, ...)                                              \
  TRAMMEL_FUZZ_TARGET(target)(const std::uint8_t* data, std::size_t size) {         \
    static const MemoryFile file(name);                                             \
    return ReadFile(file, data, size,                                               \
                    [](const std::filesystem::path& path) { return __VA_ARGS__; }); \
  }
#define PAGE_TARGET(kind)                                                        \
  TRAMMEL_FUZZ_TARGET(page_##kind)(const std::uint8_t* data, std::size_t size) { \
    static const MemoryFile file("page." #kind);                                 \
    ReadAsPages(file, Text(data, size));                                         \
    return 0;                                                                    \
  }

FILE_TARGET(alignment_result, "result.json", files::ReadAlignmentResult(path))
FILE_TARGET(board_file, "board.json", files::ReadBoardFile(path))
FILE_TARGET(budget_file, "scene.json", files::ReadBudgetFile(path))
FILE_TARGET(calibration_grid_file, "grid.json", files::ReadCalibrationGrid(path))
FILE_TARGET(offset_file, "result.json", files::ReadOffsetFile(path))
FILE_TARGET(offset_history, "offsets.jsonl", files::ReadOffsetChanges(path))
FILE_TARGET(part_file, "part.json", files::ReadPartFile(path, files::ReadMeshFile))
FILE_TARGET(pattern_prints, "patterns.jsonl",
            files::LastPatternPrint(path, "voron", files::PrintsFor::kEither))
FILE_TARGET(start_file, "start.json", files::ReadStart(path.parent_path()))
FILE_TARGET(supports_file, "supports.json", files::ReadSupportsFile(path))
FILE_TARGET(scale_bar_file, "part.json", files::ReadScaleBarFile(path))
FILE_TARGET(survey_file, "survey.json", files::ReadSurveyFile(path))

PAGE_TARGET(jpeg)
PAGE_TARGET(png)
PAGE_TARGET(tiff)

}  // namespace
}  // namespace trammel::fuzz
