// trammel-sim printer: a process that trammel takes for a printer with a camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "support/run_trammel.h"
#include "support/trammel_process.h"

namespace trammel {
namespace {

using test::CommandResult;
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
  const CommandResult doctor = RunTrammel("doctor --printer " + address, path());
  EXPECT_THAT(doctor.output, HasSubstr("/?action=stream, 160x120 px"));
  printer.Send(SIGTERM);
  EXPECT_EQ(printer.Wait(30).exit_code, 0) << printer.StandardErrorSoFar();
  EXPECT_THAT(test::ReadWhole(path() / "frames.jsonl"), HasSubstr("\"frame\""));
}

TEST_F(SimPrinterCommand, WhereThereIsNoCameraItsOptionsAreRefused) {
  const CommandResult fault = RunTrammel(std::string(kPrinter) + " --fault camera-drop=1", path());
  EXPECT_EQ(fault.exit_code, 1);
  EXPECT_THAT(fault.standard_error, HasSubstr("refuse-move"));
  const CommandResult rig = RunTrammel(std::string(kPrinter) + " --rig scale=1.1", path());
  EXPECT_EQ(rig.exit_code, 1);
  EXPECT_THAT(rig.standard_error, HasSubstr("--camera-port"));
}

}  // namespace
}  // namespace trammel
