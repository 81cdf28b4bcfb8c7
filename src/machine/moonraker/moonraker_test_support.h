// Fixture of the client's tests: a client connected to the test's own server.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine/moonraker/client/moonraker_printer.h"
#include "support/scripted_moonraker.h"

namespace trammel::machine {

inline const WaitLimit kPatience{.time_limit_s = 10};
inline const WaitLimit kShort{.time_limit_s = 0.1};

inline MoonrakerOptions OptionsFor(const test::ScriptedMoonraker& server) {
  MoonrakerOptions options;
  options.address = "127.0.0.1:" + std::to_string(server.port());
  return options;
}

class MoonrakerPrinterTest : public ::testing::Test {
 protected:
  void Connect(MoonrakerOptions options = {}) {
    test::AnswerLikeMoonraker(server_);
    const MoonrakerOptions defaults = OptionsFor(server_);
    options.address = defaults.address;
    auto printer = ConnectToMoonraker(options, kPatience);
    ASSERT_TRUE(printer) << printer.error().message;
    printer_ = std::move(*printer);
  }

  /// Sets the server's messages in reply to a script, in this order; `ok` last unless `answered` is
  /// false.
  void ScriptAnswers(std::vector<nlohmann::json> messages, bool answered = true) {
    server_.Handle("printer.gcode.script", [messages, answered](const nlohmann::json& request) {
      std::vector<nlohmann::json> all = messages;
      if (answered) {
        all.push_back(test::ResultFor(request, "ok"));
      }
      return all;
    });
  }

  std::string RunError(const std::string& script, const WaitLimit& limit = kPatience) {
    const Result<void> ran = printer_->Run(script, limit);
    EXPECT_FALSE(ran) << "the script succeeded";
    if (ran) {
      return "";
    }
    EXPECT_EQ(ran.error().kind, ErrorKind::kMachine);
    return ran.error().message;
  }

  /// Waits until the client has seen everything that was pushed so far.
  void Settle() { ASSERT_TRUE(printer_->State(kPatience)); }

  test::ScriptedMoonraker server_;
  std::unique_ptr<Printer> printer_;
};

}  // namespace trammel::machine
