#include "sim/camera/machine_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sim/camera/camera_http.h"
#include "sim/camera/unix_socket.h"
#include "sim/laser/eye_test_support.h"
#include "support/temporary_folder.h"

namespace trammel::sim {
namespace {

namespace fs = std::filesystem;

constexpr double kPatienceS = 10;  // with a loaded host; nothing here takes a hundredth of it
constexpr MachineWorld kWorld{0xfeedbeefcafe0001, {Plate::kPei, Filament::kWhite, true}, 2.5};

// A head that goes with the time, over a bed that can be changed.
class Machine final : public MachineSource {
 public:
  MachineView At(double time_s) const override {
    return {std::fmod(time_s, 1000), -0.1, 1e-3, 1.0 / 3, true, false};
  }
  std::shared_ptr<const Bed> bed(double) const override {
    const std::lock_guard lock(mutex_);
    return bed_;
  }
  void Lay(Bed bed) {
    const std::lock_guard lock(mutex_);
    bed_ = std::make_shared<const Bed>(std::move(bed));
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const Bed> bed_ = std::make_shared<const Bed>(Bed{250, 210, {}});
};

bool Same(const BeadSample& a, const BeadSample& b) {
  return a.x_mm == b.x_mm && a.y_mm == b.y_mm && a.area_mm2 == b.area_mm2 &&
         a.width_mm == b.width_mm && a.height_mm == b.height_mm;
}

bool Same(const Bed& a, const Bed& b) {
  if (a.size_x_mm != b.size_x_mm || a.size_y_mm != b.size_y_mm) return false;
  return std::equal(a.strands.begin(), a.strands.end(), b.strands.begin(), b.strands.end(),
                    [](const Strand& s, const Strand& t) {
                      return std::equal(
                          s.samples.begin(), s.samples.end(), t.samples.begin(), t.samples.end(),
                          [](const BeadSample& p, const BeadSample& q) { return Same(p, q); });
                    });
}

// A strand whose numbers have no short decimals, and one without samples.
Bed Printed() {
  Bed bed = StraightBead(-10.0 / 3, 30, 50, 0.45, 0.25);
  bed.strands.emplace_back();
  return bed;
}

class MachineLinkTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path Path() const { return folder_.path() / "machine"; }
  [[nodiscard]] std::unique_ptr<MachineLink> Serve() const {
    auto link = MachineLink::Serve(Path(), machine_, kWorld);
    if (!link) throw std::runtime_error(link.error().message);
    return std::move(*link);
  }
  [[nodiscard]] std::shared_ptr<RemoteMachine> Connect() const {
    auto remote = RemoteMachine::Connect(Path());
    if (!remote) throw std::runtime_error(remote.error().message);
    return *remote;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<Machine> machine_ = std::make_shared<Machine>();
};

TEST_F(MachineLinkTest, StateAndWorldComeOverUnchanged) {
  const auto link = Serve();
  const auto remote = Connect();
  EXPECT_EQ(remote->world().seed, kWorld.seed);
  EXPECT_EQ(remote->world().speed, kWorld.speed);
  EXPECT_EQ(ToString(remote->world().condition), ToString(kWorld.condition));
  const double now_s = MonotonicNow();
  const MachineView sent = machine_->At(now_s);
  const MachineView came = remote->At(now_s);
  EXPECT_EQ(came.x_mm, sent.x_mm);
  EXPECT_EQ(came.y_mm, sent.y_mm);
  EXPECT_EQ(came.z_mm, sent.z_mm);
  EXPECT_EQ(came.speed_mm_s, sent.speed_mm_s);
  EXPECT_TRUE(came.laser_on);
  EXPECT_FALSE(came.lights_on);
  EXPECT_TRUE(remote->Check());
}

TEST_F(MachineLinkTest, ABedComesOverUnchangedAndOnce) {
  const auto link = Serve();
  const auto remote = Connect();
  const auto bed = [&] { return remote->bed(MonotonicNow()); };
  const std::shared_ptr<const Bed> clean = bed();
  EXPECT_EQ(clean->size_y_mm, 210);
  EXPECT_TRUE(clean->strands.empty());
  EXPECT_EQ(bed(), clean) << "the same bed has the same address";
  machine_->Lay(Printed());
  const std::shared_ptr<const Bed> printed = bed();
  EXPECT_TRUE(Same(*printed, Printed()));
  EXPECT_EQ(bed(), printed);
  const auto late = Connect();
  EXPECT_TRUE(Same(*late->bed(MonotonicNow()), Printed())) << "for whoever has none yet, too";
  EXPECT_TRUE(remote->Check());
}

TEST_F(MachineLinkTest, ABedThatIsKnownIsNotSentAgain) {
  machine_->Lay(Printed());
  const auto link = Serve();
  const Result<UnixSocket> socket = UnixSocket::Connect(Path());
  ASSERT_TRUE(socket);
  const auto ask = [&](std::uint64_t known) {
    EXPECT_TRUE(socket->Send(Encode(BedQuestion{MonotonicNow(), known}), kPatienceS));
    return socket->Receive(kLongestAnswer, kPatienceS).value_or("").size();
  };
  EXPECT_GT(ask(0), sizeof(BeadSample) * Printed().strands[0].samples.size());
  EXPECT_EQ(ask(1), sizeof(std::uint64_t));
  EXPECT_GT(ask(7), sizeof(BeadSample)) << "another one than it has";
}

TEST_F(MachineLinkTest, ThePrinterLearnsWhereTheCameraIs) {
  const auto link = Serve();
  EXPECT_EQ(link->camera_port(), 0);
  const auto remote = Connect();
  ASSERT_TRUE(remote->Announce(65535));
  EXPECT_EQ(link->camera_port(), 65535);
  ASSERT_TRUE(Connect()->Announce(1234)) << "a camera that was started anew";
  EXPECT_EQ(link->camera_port(), 1234);
}

TEST_F(MachineLinkTest, SeveralThreadsAndCamerasAskAtOnce) {
  const auto link = Serve();
  const std::vector<std::shared_ptr<RemoteMachine>> remotes{Connect(), Connect(), Connect()};
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < 6; ++i) {
    threads.emplace_back([&, i, remote = remotes[i / 2]] {
      for (int round = 0; round < 100; ++round) {
        if (i == 0) machine_->Lay(Printed());
        const double now_s = MonotonicNow();
        EXPECT_EQ(remote->At(now_s).x_mm, std::fmod(now_s, 1000));
        EXPECT_LE(remote->bed(now_s)->strands.size(), 2U);
      }
    });
  }
  threads.clear();
  for (const auto& remote : remotes) EXPECT_TRUE(remote->Check());
}

TEST_F(MachineLinkTest, APrinterThatEndsIsAnErrorAndTheLastStateStays) {
  auto link = Serve();
  const auto remote = Connect();
  machine_->Lay(Printed());
  const double now_s = MonotonicNow();
  const double x_mm = remote->At(now_s).x_mm;
  const std::shared_ptr<const Bed> bed = remote->bed(now_s);
  link.reset();
  EXPECT_FALSE(fs::exists(Path()));
  const Result<void> checked = remote->Check();
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().kind, ErrorKind::kMachine);
  EXPECT_NE(checked.error().message.find(Path().string()), std::string::npos)
      << checked.error().message;
  EXPECT_EQ(remote->At(now_s + 1).x_mm, x_mm);
  EXPECT_EQ(remote->bed(now_s + 1), bed);
  EXPECT_FALSE(remote->Announce(80));
}

TEST_F(MachineLinkTest, APlaceThatCannotBeServedOrReachedIsAnError) {
  const auto nobody = RemoteMachine::Connect(Path());
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().kind, ErrorKind::kMachine);
  EXPECT_NE(nobody.error().message.find("--machine-socket"), std::string::npos);
  const auto link = Serve();
  const auto taken = MachineLink::Serve(Path(), machine_, kWorld);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().kind, ErrorKind::kMachine);
  EXPECT_NO_THROW((void)Connect()) << "the first one still serves";
  EXPECT_EQ(fs::status(Path()).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  for (const std::size_t length : {0, 101}) {
    const std::string path(length, 'x');
    EXPECT_EQ(MachineLink::Serve(path, machine_, kWorld).error().kind, ErrorKind::kInput);
    EXPECT_EQ(RemoteMachine::Connect(path).error().kind, ErrorKind::kInput);
  }
}

TEST_F(MachineLinkTest, WhoAsksNonsenseIsCutOffAndNobodyElse) {
  const auto link = Serve();
  const auto remote = Connect();
  const double now_s = MonotonicNow();
  const double never_s = std::numeric_limits<double>::quiet_NaN();
  const std::string questions[] = {
      "",
      std::string(1, '\xff'),
      std::string(1, '\0') + "hello",
      std::string(kLongestQuestion, '\1'),
      std::string(kLongestQuestion + 1, '\1'),
      Encode(ViewQuestion{now_s}) + "x",
      Encode(ViewQuestion{now_s + 100}),
      Encode(ViewQuestion{now_s - 100}),
      Encode(ViewQuestion{never_s}),
      Encode(BedQuestion{never_s, 0}),
      Encode(BedQuestion{1e300, 0}),
      Encode(CameraNotice{0}),
  };
  for (const std::string& question : questions) {
    const Result<UnixSocket> socket = UnixSocket::Connect(Path());
    ASSERT_TRUE(socket);
    // One that is too long may be cut off while it is still being sent.
    const bool sent = socket->Send(question, kPatienceS).has_value();
    ASSERT_TRUE(sent || question.size() > kLongestQuestion);
    if (!sent) continue;
    const auto answer = socket->Receive(kLongestAnswer, kPatienceS);
    EXPECT_FALSE(answer) << testing::PrintToString(question);
  }
  EXPECT_EQ(link->camera_port(), 0);
  (void)remote->At(now_s);
  EXPECT_TRUE(remote->Check());
}

TEST_F(MachineLinkTest, NoMoreThanEightClientsAreServedUntilOneLeaves) {
  const auto link = Serve();
  std::vector<std::shared_ptr<RemoteMachine>> remotes;
  for (int i = 0; i < 8; ++i) remotes.push_back(Connect());
  EXPECT_FALSE(RemoteMachine::Connect(Path()));
  remotes.pop_back();
  // The printer notices a little later.
  const double begin_s = MonotonicNow();
  bool served = false;
  while (!served && MonotonicNow() - begin_s < kPatienceS) {
    served = RemoteMachine::Connect(Path()).has_value();
  }
  EXPECT_TRUE(served);
}

// A printer that greets well and then gives one answer to whatever it is asked.
class BadPrinter {
 public:
  BadPrinter(const fs::path& path, const std::string& answer)
      : listener_(UnixSocket::Listen(path).value()), thread_([this, answer] {
          const Result<UnixSocket> client = listener_.Accept();
          if (!client || !client->Receive(kLongestQuestion, kPatienceS)) return;
          if (!client->Send(Encode(kWorld), kPatienceS)) return;
          if (client->Receive(kLongestQuestion, kPatienceS)) (void)client->Send(answer, kPatienceS);
        }) {}
  ~BadPrinter() { listener_.Shutdown(); }
  BadPrinter(const BadPrinter&) = delete;
  BadPrinter& operator=(const BadPrinter&) = delete;

 private:
  UnixSocket listener_;
  std::jthread thread_;
};

TEST_F(MachineLinkTest, AnswersThatNoMachineGivesAreErrors) {
  const auto fails = [&](const std::string& answer,
                         const std::function<void(RemoteMachine&)>& ask) {
    const BadPrinter printer(Path(), answer);
    const auto remote = Connect();
    ask(*remote);
    const Result<void> checked = remote->Check();
    EXPECT_FALSE(checked) << answer.size() << " bytes";
    if (!checked) {
      EXPECT_EQ(checked.error().kind, ErrorKind::kMachine);
    }
    fs::remove(Path());
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto view = [](RemoteMachine& remote) { EXPECT_EQ(remote.At(MonotonicNow()).x_mm, 0); };
  const auto bed = [](RemoteMachine& remote) { EXPECT_NE(remote.bed(MonotonicNow()), nullptr); };
  for (const std::string& answer :
       {std::string(), std::string(1000, 'x'), Encode(MachineView{nan}), Encode(MachineView{2e4}),
        Encode(MachineView{1, 1, 1, -1}), Encode(MachineView{}).substr(1)}) {
    fails(answer, view);
  }
  const auto laid = [](const BeadSample& sample) {
    return Encode(BedAnswer{1, std::make_shared<const Bed>(Bed{250, 250, {{{sample}}}})});
  };
  for (const std::string& answer :
       {std::string(), Encode(BedAnswer{0, machine_->bed(0)}), Encode(BedAnswer{5, nullptr}),
        laid({nan, 0, 1, 1, 1}), laid({0, 0, 1, -1, 1}), laid({0, 0, 1, 1, 1e9})}) {
    fails(answer, bed);
  }
  fails("x", [](RemoteMachine& remote) { EXPECT_FALSE(remote.Announce(80)); });
}

TEST_F(MachineLinkTest, SomebodyElsesSocketIsNoPrinter) {
  const UnixSocket listener = UnixSocket::Listen(Path()).value();
  const std::jthread other([&] {
    const Result<UnixSocket> client = listener.Accept();
    if (client) (void)client->Send("HTTP/1.1 400 Bad Request", kPatienceS);
  });
  const auto remote = RemoteMachine::Connect(Path());
  ASSERT_FALSE(remote);
  EXPECT_EQ(remote.error().kind, ErrorKind::kMachine);
}

TEST(MachineWire, ABedCutOffOrAlteredAnywhereNeverCrashes) {
  Bed bed = Printed();
  bed.strands[0].samples.resize(3);
  const std::string bytes = Encode(BedAnswer{1, std::make_shared<const Bed>(bed)});
  ASSERT_TRUE(DecodeBed(bytes));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    if (length == sizeof(std::uint64_t)) continue;  // a version alone: "as before"
    EXPECT_FALSE(DecodeBed(bytes.substr(0, length))) << length;
  }
  EXPECT_FALSE(DecodeBed(bytes + "x"));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const char value : {'\0', '\x7f', '\xff'}) {
      std::string altered = bytes;
      altered[at] = value;
      (void)DecodeBed(altered);
    }
  }
}

TEST(UnixSocketTest, TakesThePlaceOfAServerThatIsGoneButOfNoOther) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "machine.socket";
  {
    const auto killed = UnixSocket::Listen(path);  // its end leaves the file
    ASSERT_TRUE(killed) << killed.error().message;
    EXPECT_FALSE(UnixSocket::Listen(path)) << "somebody listens there";
  }
  EXPECT_TRUE(UnixSocket::Listen(path));
  std::ofstream(folder.path() / "diary") << "dear";
  EXPECT_FALSE(UnixSocket::Listen(folder.path() / "diary"));
}

TEST(UnixSocketTest, WaitsNoLongerThanItIsTold) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "socket";
  const UnixSocket listener = UnixSocket::Listen(path).value();
  const UnixSocket client = UnixSocket::Connect(path).value();
  const UnixSocket server = listener.Accept().value();
  constexpr double kShortS = 0.05;
  EXPECT_FALSE(client.Receive(100, kShortS));
  EXPECT_FALSE(client.Send(std::string(64 << 20, 'x'), kShortS)) << "nobody takes it";
  EXPECT_FALSE(server.Receive(100, kShortS)) << "longer than it may be";
}

}  // namespace
}  // namespace trammel::sim
