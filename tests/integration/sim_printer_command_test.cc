// trammel-sim printer: a process that trammel takes for a printer with a camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/trammel_process.h"

namespace trammel {
namespace {

using test::RunTrammel;
using test::TrammelProcess;
using ::testing::HasSubstr;

constexpr const char* kPrinter = "sim printer --port 0 --seed 7";
constexpr const char* kCamera =
    " --camera-port 0 --camera-frame 160x120 --camera-truth frames.jsonl";

class SimPrinterCommand : public testing::Test {
 protected:
  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(SimPrinterCommand, DoctorFindsTheCameraBehindThePrintersAddress) {
  TrammelProcess printer(std::string(kPrinter) + kCamera, path());
  const std::string address = printer.WaitForLine("listening http://");
  ASSERT_FALSE(address.empty()) << printer.StandardErrorSoFar();
  EXPECT_THAT(RunTrammel("doctor --printer " + address, path()).output,
              HasSubstr("/?action=stream, 160x120 px"));
  printer.Send(SIGTERM);
  EXPECT_EQ(printer.Wait().exit_code, 0) << printer.StandardErrorSoFar();
  EXPECT_THAT(test::ReadWhole(path() / "frames.jsonl"), HasSubstr("\"frame\""));
}

TEST_F(SimPrinterCommand, WhereThereIsNoCameraItsOptionsAreRefused) {
  EXPECT_THAT(RunTrammel(std::string(kPrinter) + " --fault camera-drop=1", path()),
              Fails(1, "refuse-move"));
  EXPECT_THAT(RunTrammel(std::string(kPrinter) + " --rig scale=1.1", path()),
              Fails(1, "--camera-port"));
}

}  // namespace
}  // namespace trammel
