// The way of an owner with a phone and without a laser: the pattern printed, its photo uploaded
// beside printer.cfg, measured and applied, over real sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fault_scenario.h"
#include "files/whole_file.h"
#include "machine_shop.h"
#include "sim/moonraker/test_client.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kPhotoTruth_s = 0.043;
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;

ShopOptions WithoutLaser() {
  ShopOptions options = WithoutCamera();
  auto& macros = options.klipper.macros;
  macros.erase("_LASER_ON");
  macros.erase("LASER_OFF");
  macros["_TRAMMEL_RELEASE"].lines = {"UPDATE_DELAYED_GCODE ID=TRAMMEL_LIMIT DURATION=0"};
  options.klipper.delayed_gcode.erase("LASER_LIMIT");
  options.klipper.delayed_gcode["TRAMMEL_LIMIT"] = {"TURN_OFF_HEATERS"};
  options.hurry = 10;
  return options;
}

class PhotoPath : public testing::Test {
 protected:
  PhotoPath() : shop_(WithoutLaser()) {}

  ProcessEnd Run(std::vector<std::string> words) {
    words.insert(words.end(), {"--printer", shop_.address()});
    return shop_.Run(words);
  }

  void Upload(const std::string& name, const std::string& data) {
    std::string body;
    const auto field = [&body](const std::string& head, const std::string& value) {
      body += "--XX\r\nContent-Disposition: form-data; " + head + "\r\n\r\n" + value + "\r\n";
    };
    field("name=\"root\"", "config");
    field("name=\"path\"", "trammel");
    field("name=\"file\"; filename=\"" + name + "\"", data);
    const auto answer =
        sim::TestHttp(shop_.server().port(), "POST", "/server/files/upload", body + "--XX--\r\n",
                      {{"Content-Type", "multipart/form-data; boundary=XX"}});
    ASSERT_EQ(answer.status, 201) << answer.body;
  }

  /// A phone's picture of what a run printed.
  std::string PhotoOf(const std::string& run) {
    const std::string file = (shop_.folder() / (run + ".jpg")).string();
    EXPECT_THAT(shop_.Run({"sim", "photo", run + "/pattern.gcode", "--pressure-advance",
                           std::to_string(kPhotoTruth_s), "--size", "1440x2560", "--seed", "41",
                           "--out", file}),
                Ends(0));
    const auto bytes = files::ReadWholeFile(file, kMaxBytes);
    return bytes ? *bytes : std::string();
  }

  /// Measures the photo into a folder.
  void ExpectTruth(const std::string& folder, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"pa", "photo", "--out", folder};
    words.insert(words.end(), more.begin(), more.end());
    ASSERT_THAT(Run(words), Ends(0));
    const auto kept =
        Must(files::ReadWholeFile(shop_.folder() / folder / "result.json", kMaxBytes));
    const json answer = json::parse(kept)["answers"][0];
    EXPECT_LE(answer["interval95"][0], kPhotoTruth_s) << answer;
    EXPECT_GE(answer["interval95"][1], kPhotoTruth_s) << answer;
  }

  MachineShop shop_;
};

TEST_F(PhotoPath, APatternIsPrintedAndMeasuredWithoutALaser) {
  EXPECT_THAT(Run({"pa", "photo"}), Fails(1, "there is no photo in the folder trammel"));
  Upload("last week.jpg", "of another pattern");
  ASSERT_THAT(
      Run({"pa", "print", "--photo", "--filament", "Generic PLA", "--out", "printed", "--set",
           "pressure_advances=[0, 0.004, 0.008, 0.012, 0.016, 0.02, 0.024, 0.028, 0.032, 0.036, "
           "0.04, 0.044, 0.048, 0.052, 0.056, 0.06, 0.064, 0.068, 0.072, 0.076, 0.08]"}),
      Prints(0, "pa analyze PHOTO --plan"));
  const PrinterLook look = shop_.Look();
  EXPECT_EQ(look.bed_target_c, 0);  // nothing has to hold it
  EXPECT_EQ(look.nozzle_target_c, 0);
  EXPECT_EQ(look.state, "ready");

  EXPECT_THAT(Run({"pa", "photo"}), Fails(1, "last week.jpg, the newest photo there, is of 20",
                                          "the pattern's print ended 20", "FILE="));
  // Somebody vouches for it.
  EXPECT_THAT(Run({"pa", "photo", "--file", "last week.jpg"}).standard_error,
              Not(HasSubstr("is of 20")));

  const std::string photo = PhotoOf("printed");
  Upload("IMG 1.jpg", photo);
  // Neither of these is a photo, and both are newer.
  Upload("notes.txt", "21 lines");
  Upload("pressure_advance-20260102T030405Z.png", "a result's picture");
  EXPECT_THAT(Run({"pa", "photo", "--filament", "petg"}),
              Fails(1, "printed for the filament 'Generic PLA'"));
  ExpectTruth("recordings/measured", {"--filament", "generic_pla"});
  const auto kept =
      Must(files::ReadWholeFile(shop_.folder() / "recordings/measured/photo.jpg", kMaxBytes));
  EXPECT_EQ(kept, photo);

  EXPECT_THAT(Run({"pa", "photo"}), Fails(1, "was measured before"));
  ExpectTruth("recordings/again", {"--file", "IMG 1.jpg"});
  // Its values are only in its plan.
  std::filesystem::rename(shop_.folder() / "printed", shop_.folder() / "elsewhere");
  EXPECT_THAT(Run({"pa", "photo", "--file", "IMG 1.jpg"}),
              Fails(1, "the plan of the pattern that was printed"));

  EXPECT_THAT(Run({"pa", "apply", "recordings/measured"}), Ends(0));
  EXPECT_NEAR(shop_.Look().settings.at("pressure advance"), kPhotoTruth_s, 0.005);
}

// Nothing is noted, so that nobody knows its values: the plan is named, or lies beside the photo.
TEST_F(PhotoPath, APatternThatSomebodyPrintedByHandIsMeasuredByItsPlanAlone) {
  ASSERT_THAT(
      shop_.Run({"pa", "pattern", "--photo", "--pa", "0:0.08:0.004", "--out", "pattern.gcode"}),
      Ends(0));
  Upload("by hand.jpg", PhotoOf("."));
  EXPECT_THAT(Run({"pa", "photo", "--out", "recordings/guessed"}),
              Fails(1, "cannot tell which values", "--plan"));
  ASSERT_THAT(Run({"pa", "photo", "--plan", "pattern.plan.json", "--out", "recordings/by-hand"}),
              Ends(0));
  const auto plan = Must(files::ReadWholeFile(shop_.folder() / "pattern.plan.json", kMaxBytes));
  Upload("pattern.plan.json", plan);
  ASSERT_THAT(Run({"pa", "photo", "--file", "by hand.jpg", "--out", "recordings/beside"}),
              Prints(0, "from 0 to 0.08 s", "pattern.plan.json, beside it"));
}

TEST_F(PhotoPath, WhatIsNoPhotoOfThePatternIsRefusedByItsCause) {
  Upload("broken.jpg", "\xFF\xD8\xFF no more");
  EXPECT_THAT(Run({"pa", "photo"}), Fails(1, "cannot tell which values the lines"));
  ASSERT_EQ(shop_.Run({"pa", "pattern", "--photo", "--out", "pattern.gcode"}).exit_code, 0);
  EXPECT_THAT(Run({"pa", "photo", "--plan", "pattern.plan.json"}), Fails(1, "photo.jpg"));
  for (const char* name : {"../printer.cfg", "printer.cfg", "away.jpg", "a/b.jpg"}) {
    const ProcessEnd refused = Run({"pa", "photo", "--file", name});
    EXPECT_THAT(refused, Fails(1, name)) << name;
    EXPECT_THAT(refused.standard_output, IsEmpty());
  }
  Upload("folder.jpg/inside.txt", "no photo");
  const ProcessEnd folder = Run({"pa", "photo", "--file", "folder.jpg"});
  EXPECT_EQ(folder.exit_code, 1);
  EXPECT_THAT(folder.standard_error, AllOf(HasSubstr("it is a folder"), Not(HasSubstr("API key"))));
  shop_.With([](sim::VirtualKlipper& klipper) {
    constexpr double kYear2100_s = 4.1e9;
    klipper.StoreConfigFile("trammel/two\nlines\".jpg", "a photo", kYear2100_s);
  });
  EXPECT_THAT(Run({"pa", "photo"}), Fails(1, "two?lines?.jpg: a file with", "rename it"));
}

TEST_F(PhotoPath, AServiceLeadsFromThePatternToTheAnswer) {
  const auto service = shop_.Serve();
  const auto ask = [&](const std::string& macro, const std::string& answer) {
    shop_.Script(macro);
    shop_.WaitUntil([&](sim::VirtualKlipper& klipper) { return TimesRead(klipper, answer) > 0; },
                    "the printer was told: " + answer, *service);
  };
  ask("TRAMMEL_PA_PATTERN FILAMENT=\"Generic PLA\"", " MSG=\"Is the bed empty?");
  shop_.Confirm();
  shop_.WaitUntil(
      [](sim::VirtualKlipper& klipper) {
        return TimesRead(klipper, "TRAMMEL_ASK BUTTONS=photo FILAMENT=generic_pla ") > 0;
      },
      "the pattern was printed", *service);
  EXPECT_EQ(shop_.Look().bed_target_c, 0);
  ask("TRAMMEL_PA_PHOTO", "no calibration: there is no photo in the folder trammel");
  std::string run;
  for (const auto& entry : std::filesystem::directory_iterator(shop_.folder() / "recordings")) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("photo_pattern-")) run = "recordings/" + name;
  }
  ASSERT_FALSE(run.empty());
  Upload("phone.jpg", PhotoOf(run));
  ask("TRAMMEL_PA_PHOTO", "BUTTONS=use");  // the printed pattern is recorded
  ask("TRAMMEL_APPLY", "kept for generic_pla on extruder/0.40");
  EXPECT_NEAR(shop_.Look().settings.at("pressure advance"), kPhotoTruth_s, 0.005);
  service->Send(SIGTERM);
  EXPECT_EQ(service->Wait().exit_code, 0);
}

}  // namespace
}  // namespace trammel::test
