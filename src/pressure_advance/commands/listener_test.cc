// What the listener does where its own work goes wrong.
#include "pressure_advance/commands/listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <stop_token>

#include "base/bug_note.h"
#include "base/check.h"
#include "session/fake_printer.h"
#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

using ::testing::HasSubstr;

// Its first calibration meets a bug; the word of it on the screen ends the test.
class BrokenPrinter : public procedure::testing::FakePrinter {
 public:
  explicit BrokenPrinter(std::stop_source stop) : stop_(std::move(stop)) {}

  Result<machine::PrinterState> State(const machine::WaitLimit&) override {
    throw Bug("the state was asked for");
  }
  Result<void> RegisterRemoteMethod(const std::string& name,
                                    std::function<void(const nlohmann::json&)> callback,
                                    const machine::WaitLimit&) override {
    methods[name] = std::move(callback);
    return {};
  }
  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    if (script.find("no calibration") != script.npos) stop_.request_stop();
    return FakePrinter::Run(script, limit);
  }

  std::map<std::string, std::function<void(const nlohmann::json&)>> methods;

 private:
  std::stop_source stop_;
};

TEST(Listener, ABugInACalibrationIsSaidAndEndsNeitherTheListenerNorTheProcess) {
  std::stop_source stop;
  BrokenPrinter printer(stop);
  const test::TemporaryFolder recordings;
  PrinterOptions options;
  options.material = "pla";
  Listener listener(printer, options, recordings.path(), false, stop.get_token());
  ASSERT_TRUE(listener.Register());
  printer.methods.at("trammel_pressure_advance")(nullptr);
  (void)listener.Serve();
  ASSERT_TRUE(stop.stop_requested());
  EXPECT_THAT(printer.scripts.back(), HasSubstr("a bug in trammel"));
  EXPECT_THAT(NotedBug().value_or(""), HasSubstr("the state was asked for"));
}

}  // namespace
}  // namespace trammel::app
