// Firmware of a coneskin board: drives the two sheets of one sensor in turn, reads them, sends frames.
//
// A frame is three phases (docs/look-up/wire-format.md has their reasons):
//   touch    A and B at the rail, C and D over their pull-downs: is there a contact between the sheets?
//   radial   a current from B to A; C and D float and read the potential at the contact: how far along?
//   angular  a current from C to D; A and B float: how far around?
// and, while the frame is on its way, half of a self-test. Wiring, parts and flashing: docs/do/firmware.md.
//
// Over the same port it takes lines of text: "?" tells what it is, "rate_hz=150" changes a setting until the next
// start, "save" keeps the settings. A guard never sends any, and answers are no frames: not while an arm is guarded.
#include <EEPROM.h>

#include "coneskin_board.h"
#include "coneskin_frame.h"

const uint8_t VERSION = 1;

// ---- Settings -----------------------------------------------------------------------------------------------------

enum Setting : uint8_t {
  DEVICE, SENSOR, FRAME_LENGTH, EXTRA_BITS, RATE_HZ, SETTLE_US, SUPPLY_PERMILLE, A_POSITIVE, D_POSITIVE, SETTINGS
};

struct SettingRow {
  const char *name;
  uint16_t low, high, usual;
};

const uint8_t MOST_EXTRA_BITS = CONVERTER.bits > 12 ? 16 - CONVERTER.bits : 4;  // a count has 16

const SettingRow ROWS[SETTINGS] = {
  {"device", 0, 65535, 0},
  {"sensor", 0, 255, 0},
  // bytes: 36 with one supply, 40 with that of each phase, 52 with the driven electrodes' own potentials as well
  {"frame_length", 36, 52, CONVERTER.frame_length},
  // n: the sum of 2^n conversions stands for a reading, which has n bits more
  {"extra_bits", 0, MOST_EXTRA_BITS, CONVERTER.extra_bits},
  {"rate_hz", 20, 1000, CONVERTER.rate_hz},  // slower, and the watchdog would bite
  {"settle_us", 10, 5000, 150},              // after switching; 5 time constants of sheets, contact and cable
  {"supply_permille", 100, 950, CONVERTER.supply_permille},  // the rail, of the converter's range: 2.5 V of 3.3 V
  {"a_positive", 0, 1, 0},                   // 1: A, not B, is at the rail in the radial phase
  {"d_positive", 0, 1, 0},                   // 1: D, not C, is at the rail in the angular phase
};

uint16_t settings[SETTINGS];

struct Stored {
  uint16_t settings[SETTINGS], crc;
};

uint16_t crc_of(const Stored &stored) {
  return coneskin_crc((const uint8_t *)stored.settings, sizeof stored.settings) ^ (VERSION + 1 + CONESKIN_CONVERTER);  // never that of zeros
}

void load_settings() {
  Stored stored;
  EEPROM.get(0, stored);
  const bool known = stored.crc == crc_of(stored);
  for (uint8_t k = 0; k < SETTINGS; k++) settings[k] = known ? stored.settings[k] : ROWS[k].usual;
}

void save_settings() {
  Stored stored;
  memcpy(stored.settings, settings, sizeof settings);
  stored.crc = crc_of(stored);
  EEPROM.put(0, stored);
#if defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_RP2040)
  EEPROM.commit();
#endif
}

// ---- Electrodes ---------------------------------------------------------------------------------------------------

enum Electrode : uint8_t { A, B, C, D };
enum Drive : uint8_t { FREE, RAIL, GROUND, PULL_DOWN };

uint8_t pull_down_pin(uint8_t k) { return CONVERTER.pull_down[k] == NONE ? BOARD.pull_down[k] : CONVERTER.pull_down[k]; }

void drive(Electrode electrode, Drive how) {
  static uint8_t now[4] = {FREE, FREE, FREE, FREE};
  if (now[electrode] == how) return;  // switching takes 10 us on a slow board
  now[electrode] = how;
  if (how != RAIL) digitalWrite(BOARD.rail[electrode], LOW);
  if (how != GROUND) digitalWrite(BOARD.ground[electrode], LOW);
  if (electrode >= C) pinMode(pull_down_pin(electrode - C), how == PULL_DOWN ? OUTPUT : INPUT);
  if (how == RAIL) digitalWrite(BOARD.rail[electrode], HIGH);
  if (how == GROUND) digitalWrite(BOARD.ground[electrode], HIGH);
}

void drive_all(Drive a, Drive b, Drive c, Drive d) {
  const Drive to[] = {a, b, c, d};
  for (uint8_t k = A; k <= D; k++)
    if (to[k] != RAIL) drive((Electrode)k, to[k]);  // open before close, or the rail is shorted for a moment
  for (uint8_t k = A; k <= D; k++)
    if (to[k] == RAIL) drive((Electrode)k, RAIL);
}

uint16_t read_channel(uint8_t channel) {
  uint32_t sum = 0;
  for (uint8_t k = 0; k < 1 << settings[EXTRA_BITS]; k++) sum += converter_read(channel);
  return sum + (sum >> CONVERTER.bits);  // so that the highest count is 2^bits - 1 here as well
}

uint16_t full_count() { return (uint32_t(1) << (CONVERTER.bits + settings[EXTRA_BITS])) - 1; }

// ---- Phases -------------------------------------------------------------------------------------------------------

ConeskinFrame frame;
uint8_t self_test_failed;  // electrodes whose readings were wrong, at ground and at the rail, one bit each
bool restarted;            // no frame has been sent since

// A guide that nothing touches floats: what the switching of the other sheet couples into it would stay for
// milliseconds. So it is held at ground until the driven sheet has settled, and then let go.
void drive_location(Drive a, Drive b, Drive c, Drive d) {
  drive_all(a == FREE ? GROUND : a, b == FREE ? GROUND : b, c == FREE ? GROUND : c, d == FREE ? GROUND : d);
  delayMicroseconds(settings[SETTLE_US] / 2);
  if (a == FREE) {
    drive(A, FREE);
    drive(B, FREE);
  } else {
    drive(C, FREE);
    drive(D, FREE);
  }
  delayMicroseconds(settings[SETTLE_US]);
}

// Read two guides, current, supply and, where they are sent, the two driven electrodes.
void read_phase(uint8_t guide, uint8_t supply, uint8_t driven, Electrode guide1, Electrode guide2, Electrode driven1,
                Electrode driven2) {
  frame.counts[guide] = read_channel(CONVERTER.sense[guide1]);
  frame.counts[guide + 1] = read_channel(CONVERTER.sense[guide2]);
  frame.counts[guide + 2] = read_channel(CONVERTER.current);
  if (frame.length > 36 || supply == CONESKIN_TOUCH_SUPPLY) frame.counts[supply] = read_channel(CONVERTER.supply);
  if (frame.length == 52) {
    frame.counts[driven] = read_channel(CONVERTER.sense[driven1]);
    frame.counts[driven + 1] = read_channel(CONVERTER.sense[driven2]);
  }
}

void measure() {
  drive_all(RAIL, RAIL, PULL_DOWN, PULL_DOWN);
  delayMicroseconds(settings[SETTLE_US]);
  read_phase(CONESKIN_TOUCH_C, CONESKIN_TOUCH_SUPPLY, CONESKIN_TOUCH_A, C, D, A, B);
  frame.clock_us = micros();
  if (settings[A_POSITIVE]) drive_location(RAIL, GROUND, FREE, FREE);
  else drive_location(GROUND, RAIL, FREE, FREE);
  read_phase(CONESKIN_RADIAL_C, CONESKIN_RADIAL_SUPPLY, CONESKIN_RADIAL_A, C, D, A, B);
  if (settings[D_POSITIVE]) drive_location(FREE, FREE, GROUND, RAIL);
  else drive_location(FREE, FREE, RAIL, GROUND);
  read_phase(CONESKIN_ANGULAR_A, CONESKIN_ANGULAR_SUPPLY, CONESKIN_ANGULAR_C, A, B, C, D);
  drive_all(GROUND, GROUND, GROUND, GROUND);
}

// All four electrodes at the same potential, touched or not: all channels must read it, and no current may flow. One
// half, at the rail, in every second frame; the other, at ground, in those between. This finds a dead or misread
// channel, a stuck switch, and an electrode that is shorted to ground, which no untouched phase shows.
void self_test() {
  const uint8_t half = frame.sequence & 1;
  const Drive where = half ? RAIL : GROUND;
  drive_all(where, where, where, where);
  delayMicroseconds(settings[SETTLE_US]);
  const uint16_t tolerance = ((uint32_t(1) << CONVERTER.bits) - 1) / 50;
  const uint16_t expected = half ? converter_read(CONVERTER.supply) : 0;
  const bool current = half && converter_read(CONVERTER.current) > 2 * tolerance;  // the amplifier's zero is above 0
  const uint8_t turn = frame.sequence / 2 % 4;
  for (uint8_t k = A; k <= D; k++) {
    if (CONVERTER.slow && k != turn) continue;
    const uint16_t seen = converter_read(CONVERTER.sense[k]);
    const bool failed = current || seen + tolerance < expected || seen > expected + tolerance;
    const uint8_t bit = 1 << (4 * half + k);
    self_test_failed = failed ? self_test_failed | bit : self_test_failed & ~bit;
  }
  drive_all(GROUND, GROUND, GROUND, GROUND);
}

uint8_t status_bits(bool late) {
  uint8_t status = late ? CONESKIN_OVERRUN : 0;
  if (restarted) status |= CONESKIN_RESTARTED;
  if (self_test_failed) status |= CONESKIN_SELF_TEST;
  if (converter_failed) status |= CONESKIN_ADC;
  converter_failed = false;
  const uint32_t expected = (uint32_t)full_count() * settings[SUPPLY_PERMILLE] / 1000;
  const uint8_t phases = frame.length == 36 ? 1 : 3;
  for (uint8_t k = 0; k < phases; k++) {
    const uint16_t supply = frame.counts[CONESKIN_TOUCH_SUPPLY + k];
    if (supply < expected - expected / 8 || supply > expected + expected / 8) status |= CONESKIN_SUPPLY;
  }
  const uint32_t level = (uint32_t)frame.counts[CONESKIN_TOUCH_C] + frame.counts[CONESKIN_TOUCH_D];
  if (5 * level >= frame.counts[CONESKIN_TOUCH_SUPPLY]) status |= CONESKIN_TOUCH;
  return status;
}

// ---- Commands -----------------------------------------------------------------------------------------------------

uint32_t next_us;  // when the next frame is due

void restart_frames() {
  frame.length = settings[FRAME_LENGTH];
  frame.device = settings[DEVICE];
  frame.sensor = settings[SENSOR];
  frame.sequence = 0;
  restarted = true;
  self_test_failed = 0;
  next_us = micros();
}

void tell_identity() {
  Serial.print(F("coneskin firmware="));
  Serial.print(VERSION);
  Serial.print(F(" board="));
  Serial.print(BOARD.name);
  Serial.print(F(" converter="));
  Serial.print(CONVERTER.name);
  Serial.print(F(" adc_bits="));
  Serial.print(CONVERTER.bits + settings[EXTRA_BITS]);
  for (uint8_t k = 0; k < SETTINGS; k++) {
    Serial.print(' ');
    Serial.print(ROWS[k].name);
    Serial.print('=');
    Serial.print(settings[k]);
    watchdog_feed();  // a slow port may take longer for the line than a hang-up may last
  }
  Serial.println();
}

// Return whether the line is "name=number" with a number that the setting may have.
bool change_setting(char *line) {
  char *value = strchr(line, '=');
  if (!value) return false;
  *value++ = '\0';
  char *end;
  const long number = strtol(value, &end, 10);
  if (end == value || *end) return false;
  for (uint8_t k = 0; k < SETTINGS; k++) {
    if (k == FRAME_LENGTH && number != 36 && number != 40 && number != 52) continue;
    if (!strcmp(line, ROWS[k].name) && number >= ROWS[k].low && number <= ROWS[k].high) {
      settings[k] = number;
      return true;
    }
  }
  return false;
}

void obey(char *line) {
  if (!strcmp(line, "save")) save_settings();
  else if (strcmp(line, "?") && !change_setting(line)) {
    Serial.println(F("coneskin: not understood; ?, save, or one of the settings that ? tells, as rate_hz=200"));
    return;
  }
  tell_identity();
  restart_frames();
}

void read_commands() {
  static char line[32];
  static uint8_t length;
  while (Serial.available()) {
    const char byte = Serial.read();
    if (byte == '\r') continue;
    if (byte == '\n') {
      line[length] = '\0';
      if (length) obey(line);
      length = 0;
    } else if (length < sizeof line - 1) {
      line[length++] = byte;
    }
  }
}

// ---- Program ------------------------------------------------------------------------------------------------------

void setup() {
  for (uint8_t k = A; k <= D; k++) {
    digitalWrite(BOARD.rail[k], LOW);
    pinMode(BOARD.rail[k], OUTPUT);
    digitalWrite(BOARD.ground[k], LOW);
    pinMode(BOARD.ground[k], OUTPUT);
  }
  for (uint8_t k = 0; k < 2; k++) digitalWrite(pull_down_pin(k), LOW);
  Serial.begin(BOARD.baud);
#if defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_RP2040)
  EEPROM.begin(sizeof(Stored));
#endif
  converter_begin();
  load_settings();
  watchdog_begin();
  restart_frames();
}

void loop() {
  do read_commands();  // once at least, or a rate that is too high would leave it deaf
  while ((int32_t)(micros() - next_us) < 0);
  const uint32_t period = 1000000UL / settings[RATE_HZ];
  const bool late = micros() - next_us > period;  // the settings ask for more than a frame's time allows
  next_us = late ? micros() + period : next_us + period;
  measure();
  frame.status = status_bits(late);
  uint8_t bytes[CONESKIN_LONGEST_FRAME];
  const size_t length = coneskin_encode(&frame, bytes);
  if ((size_t)Serial.availableForWrite() >= length) Serial.write(bytes, length);  // else it is lost: never wait here
  frame.sequence++;
  restarted = false;
  self_test();
  watchdog_feed();
}
