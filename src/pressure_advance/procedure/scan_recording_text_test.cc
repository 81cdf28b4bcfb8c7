#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pressure_advance/procedure/scan_recording.h"
#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

TEST(ScanRecording, TakesACameraWhoseNameIsNotUtf8) {
  const test::TemporaryFolder folder;
  ScanRequest request;
  request.folder = folder.path();
  request.camera = "MJPEG stream http://camera/?at=\xFF";
  ScanRecording recording(request, request.plan.lines.size());
  ASSERT_TRUE(recording.Begin());
  const auto sweeps = nlohmann::json::parse(test::ReadWhole(folder.path() / "sweeps.json"));
  EXPECT_EQ(sweeps["camera"], "MJPEG stream http://camera/?at=\xEF\xBF\xBD");
}

}  // namespace
}  // namespace trammel::procedure
