#include "service/local_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using machine::RpcAnswer;
using nlohmann::json;
using ::testing::HasSubstr;

RpcAnswer Echo(const std::string& method, const json& params) {
  if (method == "echo") return {.result = {{"params", params}}};
  return RpcAnswer::UnknownMethod(method);
}

class LocalSocketTest : public ::testing::Test {
 protected:
  std::unique_ptr<LocalSocket> Listen() {
    auto listening = LocalSocket::Listen(path_, Echo);
    EXPECT_TRUE(listening) << listening.error().message;
    return listening ? std::move(*listening) : nullptr;
  }
  test::TemporaryFolder folder_;
  const fs::path path_ = LocalSocketPath(folder_.path(), "ws://localhost:7125/websocket");
};

TEST_F(LocalSocketTest, AnswersWithTheResultOrTheError) {
  const auto listening = Listen();
  const auto answer = AskLocally(path_, "echo", {{"a", 1}});
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(*answer, (json{{"params", {{"a", 1}}}}));
  const auto refused = AskLocally(path_, "cook", json::object());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("cook"));
}

TEST_F(LocalSocketTest, IsForItsUserAloneAndGoesWithItsService) {
  {
    const auto listening = Listen();
    struct stat there {};
    ASSERT_EQ(lstat(path_.c_str(), &there), 0);
    EXPECT_EQ(there.st_mode & 0777, 0600U);
    const auto second = LocalSocket::Listen(path_, Echo);
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().message, HasSubstr("another trammel serve"));
  }
  EXPECT_FALSE(fs::exists(path_));
  const auto answer = AskLocally(path_, "echo", json::object());
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(answer.error().message, HasSubstr("no trammel serve answers"));
}

TEST_F(LocalSocketTest, TakesThePlaceOfASocketThatAKilledServiceLeftAndOfNothingElse) {
  const int left = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& text = path_.native();
  std::copy(text.begin(), text.end(), address.sun_path);
  ASSERT_EQ(bind(left, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(left);
  EXPECT_TRUE(Listen());
  test::WriteWhole(path_, "mine");
  EXPECT_FALSE(LocalSocket::Listen(path_, Echo));
  EXPECT_EQ(test::ReadWhole(path_), "mine");
}

TEST(LocalSocket, APathFitsIntoASocketsNameHoweverLongThePrintersAddressIs) {
  const fs::path path = LocalSocketPath("/home/a-rather-long-user-name/.local/state/trammel",
                                        "wss://" + std::string(200, 'x') + "/websocket");
  EXPECT_LT(path.native().size(), sizeof(sockaddr_un::sun_path));
  EXPECT_NE(LocalSocketPath("/s", "ws://a"), LocalSocketPath("/s", "ws://b"));
}

TEST(AnswerLine, RefusesWhatIsNoRequest) {
  const auto code = [](const std::string& line) {
    return json::parse(AnswerLine(line, Echo))["error"]["code"];
  };
  EXPECT_EQ(code("{"), -32700);
  EXPECT_EQ(code("[]"), -32600);
  EXPECT_EQ(code(R"({"method":"echo","id":1})"), -32600);
  EXPECT_EQ(code(R"({"jsonrpc":"2.0","method":3,"id":1})"), -32600);
  EXPECT_EQ(code(R"({"jsonrpc":"2.0","method":"echo","id":[]})"), -32600);
  EXPECT_EQ(code(R"({"jsonrpc":"2.0","method":"cook","id":1})"), -32601);
  EXPECT_EQ(AnswerLine(R"({"jsonrpc":"2.0","method":"echo"})", Echo), "");
}

}  // namespace
}  // namespace trammel::service
