// Asked to end while it waits for a printer or a camera that may never come, trammel says that it
// was stopped: exit code 130, and no word of what else there might be to mend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <memory>
#include <string>
#include <vector>

#include "machine_shop.h"
#include "support/matchers.h"
#include "support/scripted_http.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kInterrupted = 130;

/// A server that takes every request and answers none.
std::shared_ptr<ScriptedHttp> Silent() {
  return std::make_shared<ScriptedHttp>(
      [](const std::string&, HttpPeer& peer) { peer.WaitForClose(); });
}

ShopOptions StartingForever() {
  ShopOptions options;
  options.faults.startup_s = 1e6;
  return options;
}

ProcessEnd StopAt(const std::string& words, int signal, const MachineShop& shop,
                  TrammelProcess& process) {
  shop.WaitUntilSaid(words, process);
  process.Send(signal);
  return process.Wait();
}

TEST(Stop, WhileKlipperStartsIsAStopAndNoFaultOfThePrinter) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const MachineShop shop(StartingForever());
    EXPECT_THAT(StopAt("waiting for the printer to start", signal, shop, *shop.Calibrate()),
                Fails(kInterrupted, "stopped"))
        << "signal " << signal;
    EXPECT_FALSE(std::filesystem::exists(shop.folder() / "rec"));
  }
}

TEST(Stop, OfADoctorAccusesNobody) {
  const MachineShop shop(StartingForever());
  TrammelProcess process({"doctor", "--printer", shop.address()}, shop.folder());
  EXPECT_THAT(StopAt("waiting for the printer to start", SIGINT, shop, process),
              Prints(kInterrupted, "---  printer", Not(HasSubstr("FIX  printer")),
                     Not(HasSubstr("FIX  camera"))));
}

TEST(Stop, WhileItConnectsIsAStop) {
  const auto silent = Silent();
  const MachineShop shop;
  TrammelProcess process(
      {"pa", "calibrate", "--printer", "127.0.0.1:" + std::to_string(silent->port())},
      shop.folder());
  shop.WaitUntil([&](sim::VirtualKlipper&) { return !silent->requests().empty(); },
                 "the server was asked", process);
  process.Send(SIGHUP);
  EXPECT_THAT(process.Wait(), Fails(kInterrupted, "stopped while connecting"));
}

TEST(Stop, WhileTheCameraIsOpenedIsAStopAndLeavesThePrinterAsItWas) {
  const auto silent = Silent();
  ShopOptions options;
  options.config["camera"] = "url = \"" + silent->Url("/stream") + "\"\n";
  const MachineShop shop(options);
  const PrinterLook before = shop.Look();
  EXPECT_THAT(StopAt("looking at the camera", SIGTERM, shop, *shop.Calibrate()),
              Fails(kInterrupted, "stopped"));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
}

}  // namespace
}  // namespace trammel::test
