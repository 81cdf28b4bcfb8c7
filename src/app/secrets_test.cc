#include "app/secrets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

using settings::ScanSettings;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class Secrets : public testing::Test {
 protected:
  ~Secrets() override { unsetenv("TRAMMEL_API_KEY"); }
  std::string File(const std::string& text, mode_t rights = 0600) {
    const std::string path = (folder_.path() / "secret").string();
    test::WriteWhole(path, text);
    chmod(path.c_str(), rights);
    return path;
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(Secrets, TheKeyComesFromTheEnvironmentAFileOrTheSettings) {
  ScanSettings settings;
  ASSERT_TRUE(SettleApiKey(settings));
  EXPECT_EQ(settings.api_key, "");
  settings.api_key_file = File("from-file\r\nmore\n");
  ASSERT_TRUE(SettleApiKey(settings));
  EXPECT_EQ(settings.api_key, "from-file");
  ScanSettings own;
  own.api_key = "own";
  ASSERT_TRUE(SettleApiKey(own));
  EXPECT_EQ(own.api_key, "own");
  setenv("TRAMMEL_API_KEY", "from-environment", 1);
  ASSERT_TRUE(SettleApiKey(own));
  EXPECT_EQ(own.api_key, "from-environment");
}

TEST_F(Secrets, AKeyThatCannotBeOneIsRefusedWithoutShowingIt) {
  ScanSettings both;
  both.api_key = "hunter2";
  both.api_key_file = File("other");
  EXPECT_THAT(SettleApiKey(both).error().message, Not(HasSubstr("hunter2")));
  for (const std::string text : {"", "\n", "hunter2 hunter2", "hunter2\xFF"}) {
    ScanSettings settings;
    settings.api_key_file = File(text);
    const auto settled = SettleApiKey(settings);
    ASSERT_FALSE(settled) << text;
    EXPECT_THAT(settled.error().message, AllOf(HasSubstr("secret"), Not(HasSubstr("hunter2"))));
  }
  ScanSettings missing;
  missing.api_key_file = "/no/such/file";
  EXPECT_THAT(SettleApiKey(missing).error().message, HasSubstr("/no/such/file"));
}

TEST_F(Secrets, APasswordAmongTheWordsOfACommandIsRefused) {
  for (const char* address : {"http://me:hunter2@camera/", "https://camera/?token=hunter2"}) {
    const auto refused = CameraAddressOf("--camera", address);
    ASSERT_FALSE(refused) << address;
    EXPECT_THAT(refused.error().message,
                AllOf(HasSubstr("--camera @FILE"), Not(HasSubstr("hunter2"))));
  }
  EXPECT_EQ(*CameraAddressOf("--camera", "http://camera/?action=stream"),
            "http://camera/?action=stream");
  EXPECT_EQ(*CameraAddressOf("--camera", "@" + File("http://me:hunter2@camera/\n")),
            "http://me:hunter2@camera/");
  EXPECT_FALSE(CameraAddressOf("--camera", "@/no/such/file"));
}

TEST_F(Secrets, FilesThatOthersMayReadAreNamed) {
  EXPECT_THAT(CheckSecretFiles({File("hunter2", 0600), "/no/such/file"}), IsEmpty());
  const auto checks = CheckSecretFiles({File("hunter2", 0640)});
  ASSERT_THAT(checks, SizeIs(1));
  EXPECT_TRUE(checks[0].advice && !checks[0].passed);
  EXPECT_THAT(checks[0].detail, AllOf(HasSubstr("chmod 600"), Not(HasSubstr("hunter2"))));
}

}  // namespace
}  // namespace trammel::app
