// Mover of python -m bench reaction: turns the base of an arm through Universal Robots' client library, as the ROS driver does.
//
// urcl_mover HOST SCRIPT; lines on stdin: "prepare" sends the control program again where it has ended; a number is the
// base's target [rad], to which it turns at 1 rad/s by a joint position in each cycle. "=" says that a line is done with.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iostream>
#include <string>
#include <thread>

#include <unistd.h>

#include <ur_client_library/log.h>
#include <ur_client_library/ur/ur_driver.h>

static std::atomic<bool> running{ false };

static bool waitUntilRunning()
{
  for (int i = 0; i < 3000 && !running; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return running;
}

// A bench that is killed says nothing, and the library waits for ever for a controller that died with it.
static void endWithParent()
{
  std::thread([parent = getppid()] {
    while (getppid() == parent)
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    _exit(1);
  }).detach();
}

int main(int argc, char* argv[])
{
  if (argc < 3)
    return 2;
  endWithParent();
  urcl::setLogLevel(urcl::LogLevel::FATAL);
  urcl::UrDriverConfiguration config;
  config.robot_ip = argv[1];
  config.script_file = argv[2];
  config.output_recipe = { "timestamp", "actual_q" };
  config.input_recipe = { "speed_slider_mask", "speed_slider_fraction" };
  config.headless_mode = true;
  config.handle_program_state = [](bool now) { running = now; };
  urcl::UrDriver driver(config);
  driver.startRTDECommunication();
  urcl::rtde_interface::DataPackage data(driver.getRTDEOutputRecipe());
  std::cout << "=" << std::endl;
  for (std::string line; std::getline(std::cin, line); std::cout << "=" << std::endl)
  {
    if (line == "prepare")
    {
      if (!running)
        driver.sendRobotProgram();
      if (!waitUntilRunning())
        return 1;
      continue;
    }
    const double goal = std::stod(line);
    urcl::vector6d_t start, target;
    while (!driver.getDataPackage(data) || !data.getData("actual_q", start))
    {
    }
    const auto begin = std::chrono::steady_clock::now();
    const double side = goal > start[0] ? 1.0 : -1.0;
    for (double t = 0.0; running && t < 3.0;)
    {
      driver.getDataPackage(data);  // a new one: the controller's cycle sets the pace
      t = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      const double ramp = std::min(t, 0.1), way = 0.5 * ramp * ramp / 0.1 + std::max(0.0, t - 0.1);
      target = start;
      target[0] += side * std::min(way, std::abs(goal - start[0]));
      if (!driver.writeJointCommand(target, urcl::comm::ControlMode::MODE_SERVOJ,
                                    urcl::RobotReceiveTimeout::millisec(200)))
        break;
    }
  }
}
