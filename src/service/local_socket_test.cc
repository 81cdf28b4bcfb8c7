#include "service/local_socket.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <string>
#include <thread>
#include <vector>

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

class CrowdedSocketTest : public LocalSocketTest {
 protected:
  int Connect() const {
    const int client = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string& text = path_.native();
    std::copy(text.begin(), text.end(), address.sun_path);
    EXPECT_EQ(connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return client;
  }
};

TEST_F(CrowdedSocketTest, SilentClientsLockNobodyOut) {
  const auto listening = Listen();
  std::vector<int> silent;
  for (int i = 0; i < 40; ++i) {
    silent.push_back(Connect());
    if (i % 13 != 0) continue;
    const auto answer = AskLocally(path_, "echo", {{"a", i}});
    ASSERT_TRUE(answer) << i << ": " << answer.error().message;
  }
  const auto answer = AskLocally(path_, "echo", {{"a", 1}});
  EXPECT_TRUE(answer) << answer.error().message;
  for (const int client : silent) close(client);
}

// A listener without a descriptor to give is ready all the time.
TEST_F(CrowdedSocketTest, WithoutDescriptorsItWaitsAndThenGoesOn) {
  const auto listening = Listen();
  const int client = Connect();
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit few{100, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  std::vector<int> taken;
  for (int fd = open("/dev/null", O_RDONLY); fd >= 0; fd = dup(fd)) taken.push_back(fd);
  ASSERT_FALSE(taken.empty());
  close(taken.back());
  taken.pop_back();
  const int waiting = Connect();  // its other end finds no descriptor
  const auto used = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double before_s = used();
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  constexpr double kSpinning_s = 0.2;  // it spun for all of the 0.6 s
  EXPECT_LT(used() - before_s, kSpinning_s);
  for (const int fd : taken) close(fd);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  close(waiting);
  close(client);
  const auto answer = AskLocally(path_, "echo", {{"a", 1}});
  EXPECT_TRUE(answer) << answer.error().message;
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
