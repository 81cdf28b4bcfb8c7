// trammel-sim printer and trammel-sim camera: two processes that a calibration takes for a printer.
#include <fmt/format.h>
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

constexpr const char* kPrinter = "sim printer --port 0 --machine-socket machine --seed 7";
constexpr const char* kCamera = "sim camera --machine machine --port 0 --frame 160x120";
constexpr const char* kAddress = "listening http://";

class SimPrinterCommand : public testing::Test {
 protected:
  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(SimPrinterCommand, DoctorFindsTheCameraOfAnotherProcessBehindThePrintersAddress) {
  TrammelProcess printer(kPrinter, path());
  const std::string printer_address = printer.WaitForLine(kAddress);
  ASSERT_FALSE(printer_address.empty()) << printer.StandardErrorSoFar();
  TrammelProcess camera(kCamera, path());
  const std::string camera_address = camera.WaitForLine(kAddress);
  ASSERT_FALSE(camera_address.empty()) << camera.StandardErrorSoFar();
  const CommandResult doctor = RunTrammel("doctor --printer " + printer_address, path());
  EXPECT_THAT(doctor.output, HasSubstr("http://" + camera_address + "/?action=stream, 160x120 px"));
  camera.Send(SIGTERM);
  EXPECT_EQ(camera.Wait(30).exit_code, 0) << camera.StandardErrorSoFar();
  printer.Send(SIGTERM);
  EXPECT_EQ(printer.Wait(30).exit_code, 0) << printer.StandardErrorSoFar();
  EXPECT_FALSE(std::filesystem::exists(path() / "machine"));
}

TEST_F(SimPrinterCommand, TheCameraSaysThatItsPrinterIsGone) {
  TrammelProcess printer(kPrinter, path());
  ASSERT_FALSE(printer.WaitForLine(kAddress).empty()) << printer.StandardErrorSoFar();
  TrammelProcess camera(kCamera, path());
  ASSERT_FALSE(camera.WaitForLine(kAddress).empty()) << camera.StandardErrorSoFar();
  printer.Send(SIGKILL);
  EXPECT_EQ(camera.Wait(30).exit_code, 3);
  EXPECT_THAT(camera.StandardErrorSoFar(), HasSubstr("machine socket machine"));
  EXPECT_THAT(camera.StandardErrorSoFar(), HasSubstr("closed the connection"));
}

TEST_F(SimPrinterCommand, WhatCannotBeServedIsSaid) {
  const CommandResult alone = RunTrammel(kCamera, path());
  EXPECT_EQ(alone.exit_code, 3);
  EXPECT_THAT(alone.standard_error, HasSubstr("sim printer --machine-socket machine"));
  // Where there is no camera, its faults are none.
  const CommandResult fault = RunTrammel(fmt::format("{} --fault camera-drop=1", kPrinter), path());
  EXPECT_EQ(fault.exit_code, 1);
  const CommandResult other = RunTrammel(fmt::format("{} --fault printing=1", kCamera), path());
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.standard_error, HasSubstr("camera-stall-at"));
}

}  // namespace
}  // namespace trammel
