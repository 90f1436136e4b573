/* Emulated board: the compiled firmware in simavr, cycle by cycle, wired to the circuit of board_circuit.h.

   usage: simavr_board ELF PORT_FD TRACE SECONDS NAME=NUMBERS...
   PORT_FD takes what the serial port sends, and gives what it receives; TRACE is a file for one line a conversion, or
   "-"; SECONDS is how long to run as fast as possible, or 0: in real time, until standard input ends. Standard input
   takes lines "AFTER COMMAND", AFTER in seconds from when the line is read (where SECONDS is given, all are read at
   the start): sheets Y11..Y44, supply V, power off, power on, hang, port CHARACTERS, port off, port on,
   bus off, bus on: the bus of the chips that stand in for the controller's converter where one is set ("chip=1115"). */
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#include "board_circuit.h"
#include "ads1x15.h"
#include "ltc1867.h"

enum { DDR_B = 0x24, PORT_B = 0x25, DDR_C = 0x27, PORT_C = 0x28, DDR_D = 0x2A, PORT_D = 0x2B, SPCR = 0x4C, SPSR, SPDR, SELECT_BIT = 2 }; /* of an ATmega328P */
static const double SLICE = 1e-3; /* s; a full-speed USB port hands bytes on about as often */
static const double TICKS = 1e4;  /* units of the emulated converter in a volt: finer than its millivolts */

typedef struct Command {
  double due;
  char text[512];
  struct Command *next;
} Command;

static Circuit circuit;
static avr_t *avr;
static avr_irq_t *converter, *port_input, *bus_input;
static Command *commands;
static FILE *trace;
static double off_time;                     /* s without power: the controller's cycles stand still */
static int powered = 1, linked = 1, port_full, pins[12], sense[4], current_channel = 4, supply_channel = 5;
static Ads chips[2];
static Ltc ltc;
static double chip_kind; /* 1015, 1115 or 1867: what stands in for the controller's own converter; 0: nothing */
static int ads_linked = 1;
static double reference = 3.3, sense_gain = 50.0, bias = 0.0, noise = 1.5e-3;
static uint8_t sent[4096], received[4096];
static size_t sent_count, received_count, received_at;
static uint64_t random_state = 1;

static double seconds(void) { return off_time + (double)avr->cycle / avr->frequency; }

static double gauss(void) {
  double sum = 0.0; /* of twelve numbers, each in 0..1: variance 1 */
  for (int k = 0; k < 12; k++) {
    random_state = random_state * 6364136223846793005ULL + 1442695040888963407ULL;
    sum += (double)(random_state >> 40) / 16777216.0;
  }
  return sum - 6.0;
}

static int pin_state(int pin) {
  const int shift = pin < 8 ? pin : pin < 14 ? pin - 8 : pin - 14; /* 14 is A0 */
  const int out = avr->data[pin < 8 ? DDR_D : pin < 14 ? DDR_B : DDR_C] >> shift & 1;
  const int high = avr->data[pin < 8 ? PORT_D : pin < 14 ? PORT_B : PORT_C] >> shift & 1;
  return out ? (high ? PIN_HIGH : PIN_LOW) : high ? PIN_PULLED_UP : PIN_FREE;
}

static double channel_volts(const double *volts, int channel) {
  for (int k = 0; k < 4; k++)
    if (channel == sense[k]) return volts[k];
  if (channel == supply_channel) return volts[RAIL_NODE];
  if (channel == current_channel) return bias + sense_gain * (circuit.supply - volts[RAIL_NODE]);
  return 0.0;
}

static void select_chip(void) {
  double volts[NODES];
  if (!(avr->data[PORT_B] >> SELECT_BIT & 1)) {
    ltc_fall(&ltc, seconds());
    return;
  }
  advance(&circuit, seconds());
  if (circuit.changed) rewire(&circuit);
  potentials(&circuit, volts);
  ltc_rise(&ltc, seconds(), channel_volts(volts, ltc_input(&ltc)) + noise / 16.0 * gauss());
}

/* The SPI of the controller, in the place of simavr's, at which a byte takes 100 us whatever the clock. */
static uint8_t spi_out, spi_in;

static avr_cycle_count_t end_byte(avr_t *which, avr_cycle_count_t when, void *param) {
  (void)when, (void)param;
  spi_in = ads_linked ? ltc_byte(&ltc, spi_out) : 0;
  which->data[SPSR] |= 0x80;
  return 0;
}

static void begin_byte(avr_t *which, avr_io_addr_t address, uint8_t value, void *param) {
  static const uint8_t dividers[] = {4, 16, 64, 128};
  (void)address, (void)param;
  spi_out = value;
  which->data[SPSR] &= 0x7F;
  avr_cycle_timer_register(which, 8u * dividers[which->data[SPCR] & 3] >> (which->data[SPSR] & 1), end_byte, NULL);
}

static uint8_t read_byte(avr_t *which, avr_io_addr_t address, void *param) {
  (void)address, (void)param;
  which->data[SPSR] &= 0x7F;
  return spi_in;
}

static void follow_pins(void) {
  static uint64_t before = 1;
  const uint8_t *at = avr->data;
  const uint32_t low = at[DDR_B] | at[PORT_B] << 8 | at[DDR_D] << 16 | (uint32_t)at[PORT_D] << 24;
  const uint64_t after = (uint64_t)(at[DDR_C] | at[PORT_C] << 8) << 32 | low;
  if (after == before) return;
  const uint64_t changed = after ^ before;
  before = after;
  if (chip_kind == 1867.0 && changed >> (8 + SELECT_BIT) & 1) select_chip();
  if (!(changed & ~((uint64_t)1 << (8 + SELECT_BIT)))) return;
  advance(&circuit, seconds());
  for (int k = 0; k < 4; k++) {
    circuit.closed[k] = pin_state(pins[k]) == PIN_HIGH; /* a resistor holds the gate of a switch low otherwise */
    circuit.ground[k] = pin_state(pins[4 + k]) == PIN_HIGH;
    if (k < 2) circuit.down[k] = pin_state(pins[8 + k]);
  }
  circuit.changed = 1;
}

static void convert(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  const union { avr_adc_mux_t mux; uint32_t bits; } request = {.bits = value};
  if (request.mux.kind != ADC_MUX_SINGLE) return;
  const int channel = request.mux.src;
  double volts[NODES];
  advance(&circuit, seconds());
  if (circuit.changed) rewire(&circuit);
  potentials(&circuit, volts);
  const double here = channel_volts(volts, channel);
  if (trace) {
    fprintf(trace, "%.7f %d %.6f %.6f", seconds(), channel, here, channel_volts(circuit.settled, channel));
    for (int k = 0; k < 4; k++) fprintf(trace, " %d", circuit.closed[k] ? 9 : circuit.ground[k] ? PIN_LOW : PIN_FREE);
    fprintf(trace, " %d %d\n", circuit.down[0], circuit.down[1]);
  }
  const double seen = here + noise * gauss();
  const double top = reference * TICKS;
  const double ticks = seen * TICKS;
  avr_raise_irq(converter + ADC_IRQ_ADC0 + channel, ticks < 0.0 ? 0 : ticks > top ? (uint32_t)top : (uint32_t)ticks);
}

/* Begin or end a conversion of a chip: what it reads is the mean over its time, as of a delta-sigma converter. */
static double read_channel_mean(int channel, double since, double until) {
  enum { PARTS = 8 };
  double sum = 0.0, volts[NODES];
  advance(&circuit, seconds());
  if (circuit.changed) rewire(&circuit);
  Circuit then = circuit;
  for (int k = 0; k < PARTS; k++) {
    then.now = since + (k + 0.5) * (until - since) / PARTS;
    if (then.now < then.since) then.now = then.since; /* the firmware switches nothing while it waits */
    potentials(&then, volts);
    sum += channel_volts(volts, channel);
  }
  return sum / PARTS + noise / 4.0 * gauss();
}

static void use_bus(struct avr_irq_t *irq, uint32_t value, void *param) {
  const avr_twi_msg_irq_t seen = {.u.v = value};
  (void)irq, (void)param;
  for (int k = 0; k < 2; k++) {
    Ads *chip = &chips[k];
    if (seen.u.twi.msg & TWI_COND_STOP) chip->selected = 0;
    if (seen.u.twi.msg & TWI_COND_START) ads_select(chip, seen.u.twi.addr >> 1 == 0x48 + k && ads_linked);
    if (!chip->selected) continue;
    uint32_t answer = avr_twi_irq_msg(TWI_COND_ACK, seen.u.twi.addr, 1);
    if (seen.u.twi.msg & TWI_COND_WRITE) {
      if (ads_write(chip, seen.u.twi.data)) chip->began = seconds();
    } else if (seen.u.twi.msg & TWI_COND_READ) {
      const double end = chip->began + ads_time((int)chip_kind);
      if (chip->busy && seconds() >= end) ads_finish(chip, (int)chip_kind, read_channel_mean(4 * k + ads_input(chip), chip->began, end));
      answer = avr_twi_irq_msg(TWI_COND_READ, seen.u.twi.addr, ads_read(chip));
    }
    avr_raise_irq(bus_input, answer);
  }
}

static void send_byte(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  if (sent_count < sizeof sent) sent[sent_count++] = (uint8_t)value;
}

static void port_is_full(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)value;
  port_full = param != NULL;
}

static void use_port(int descriptor, int batch) {
  for (size_t at = 0; linked && at < sent_count;) {
    const ssize_t count = write(descriptor, sent + at, sent_count - at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0 && batch) exit(3);
    if (count <= 0) break; /* nobody reads: lost, as on a real line */
    at += (size_t)count;
  }
  sent_count = 0;
  if (received_at == received_count && !batch) {
    const ssize_t count = read(descriptor, received, sizeof received);
    received_at = 0;
    received_count = count > 0 ? (size_t)count : 0;
  }
  if (received_at < received_count && !port_full) avr_raise_irq(port_input, received[received_at++]); /* 1 a slice */
}

static void obey(const char *text) {
  advance(&circuit, seconds());
  if (!strncmp(text, "sheets ", 7)) {
    char *at = (char *)text + 7;
    for (int k = 0; k < 16; k++) circuit.sheets[k / 4][k % 4] = strtod(at, &at);
  } else if (!strncmp(text, "supply ", 7)) {
    circuit.supply = atof(text + 7);
  } else if (!strcmp(text, "power off")) {
    powered = 0;
  } else if (!strcmp(text, "power on")) {
    powered = 1;
    avr_reset(avr);
  } else if (!strcmp(text, "hang")) { /* at the endless loop that ends every program of this compiler, interrupts off */
    avr->sreg[S_I] = 0;
    avr->pc = avr->codeend - 1;
    avr->flash[avr->pc] = 0xFF, avr->flash[avr->pc + 1] = 0xCF;
  } else if (!strcmp(text, "bus off")) {
    ads_linked = 0;
  } else if (!strcmp(text, "bus on")) {
    ads_linked = 1;
  } else if (!strcmp(text, "port off")) {
    linked = 0;
  } else if (!strcmp(text, "port on")) {
    linked = 1;
  } else if (!strncmp(text, "port ", 5) && received_count + strlen(text) < sizeof received) {
    received_count += (size_t)sprintf((char *)received + received_count, "%s\n", text + 5);
  } else {
    fprintf(stderr, "unknown command: %s\n", text);
    exit(2);
  }
  circuit.changed = 1;
}

static void take_line(char *line) {
  Command *one = calloc(1, sizeof *one), **at = &commands;
  char *rest;
  one->due = seconds() + strtod(line, &rest);
  snprintf(one->text, sizeof one->text, "%s", *rest == ' ' ? rest + 1 : rest);
  while (*at && (*at)->due <= one->due) at = &(*at)->next;
  one->next = *at;
  *at = one;
}

/* Take the lines that have come; return whether there may be more. */
static int take_lines(void) {
  static char buffer[65536];
  static size_t count;
  const ssize_t more = read(0, buffer + count, sizeof buffer - 1 - count);
  if (more == 0) return 0;
  if (more < 0) return errno == EAGAIN || errno == EINTR;
  count += (size_t)more;
  buffer[count] = '\0';
  char *line = buffer;
  for (char *end; (end = strchr(line, '\n')); line = end + 1) {
    *end = '\0';
    take_line(line);
  }
  count -= (size_t)(line - buffer);
  memmove(buffer, line, count);
  return 1;
}

static void set(const char *word) {
  const char *equals = strchr(word, '=');
  const size_t length = equals ? (size_t)(equals - word) : 0;
  const struct { const char *name; double *at; } numbers[] = {
    {"supply", &circuit.supply}, {"shunt", &circuit.shunt}, {"leads", &circuit.leads}, {"pin", &circuit.pin},
    {"switches", &circuit.switches}, {"pulldown", &circuit.pulldown}, {"input", &circuit.input},
    {"cable", &circuit.cable}, {"layers", &circuit.layers}, {"reference", &reference}, {"gain", &sense_gain},
    {"noise", &noise}, {"bias", &bias}, {"chip", &chip_kind},
  };
  for (size_t k = 0; equals && k < sizeof numbers / sizeof *numbers; k++)
    if (strlen(numbers[k].name) == length && !strncmp(word, numbers[k].name, length)) {
      *numbers[k].at = atof(equals + 1);
      return;
    }
  char *at = (char *)equals + 1;
  if (length == 4 && !strncmp(word, "pins", 4)) { /* rail x 4, ground x 4, pull-down x 2, then six channels */
    for (int k = 0; k < 10; k++) pins[k] = (int)strtol(at, &at, 10) , at++;
    for (int k = 0; k < 4; k++) sense[k] = (int)strtol(at, &at, 10), at++;
    current_channel = (int)strtol(at, &at, 10), at++;
    supply_channel = (int)strtol(at, &at, 10);
    return;
  }
  fprintf(stderr, "unknown setting: %s\n", word);
  exit(2);
}

int main(int count, char **words) {
  if (count < 5) return 2;
  circuit = (Circuit){.supply = 2.5, .shunt = 11.3, .leads = 1.0, .pin = 25.0, .switches = 2.0, .pulldown = 10e3,
                      .input = 10e6, .pullup = 35e3, .logic = 5.0, .cable = 330e-12, .layers = 500e-12, .rail = 1e-9,
                      .changed = 1};
  const int port = dup(atoi(words[2]));
  if (port < 0 || !freopen("/dev/null", "w", stdout)) return 2; /* the emulator tells there what it loads */
  const double end = atof(words[4]);
  const int batch = end > 0.0;
  if (strcmp(words[3], "-") && !(trace = fopen(words[3], "w"))) return 2;
  for (int k = 5; k < count; k++) set(words[k]);

  elf_firmware_t firmware;
  memset(&firmware, 0, sizeof firmware);
  if (elf_read_firmware(words[1], &firmware) != 0) return 2;
  avr = avr_make_mcu_by_name("atmega328p");
  if (!avr) return 2;
  avr_init(avr);
  avr->frequency = 16000000;
  avr->log = LOG_NONE;
  avr_load_firmware(avr, &firmware);
  avr->aref = (uint32_t)(reference * TICKS);
  avr->vcc = avr->avcc = (uint32_t)(5.0 * TICKS);
  converter = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), convert, NULL);
  for (uint8_t k = 0; k < 2; k++) avr_extint_set_strict_lvl_trig(avr, k, 0); /* polling for it takes half of the time */
  if (chip_kind == 1867.0) {
    avr->io[AVR_DATA_TO_IO(SPDR)].w.c = begin_byte;
    avr->io[AVR_DATA_TO_IO(SPDR)].r.c = read_byte;
  } else if (chip_kind > 0.0) {
    bus_input = avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), use_bus, NULL);
  }
  uint32_t quiet = 0;
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &quiet);
  port_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), send_byte, NULL);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), port_is_full, NULL);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), port_is_full, avr);

  if (!batch) fcntl(0, F_SETFL, O_NONBLOCK);
  while (batch && take_lines());
  struct timespec due;
  clock_gettime(CLOCK_MONOTONIC, &due);
  for (double slice = SLICE; !batch || slice <= end; slice += SLICE) {
    if (!batch && !take_lines()) break;
    while (commands && commands->due <= seconds()) {
      Command *one = commands;
      commands = one->next;
      obey(one->text);
      free(one);
    }
    if (!powered) off_time += slice - seconds();
    while (seconds() < slice) {
      const int state = avr_run(avr);
      if (state == cpu_Done || state == cpu_Crashed) {
        fprintf(stderr, "the controller has stopped at pc 0x%x\n", avr->pc);
        return 4;
      }
      follow_pins();
    }
    use_port(port, batch);
    if (!batch) {
      due.tv_nsec += (long)(1e9 * SLICE);
      if (due.tv_nsec >= 1000000000L) due.tv_nsec -= 1000000000L, due.tv_sec++;
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
    }
  }
  if (trace) fclose(trace);
  return 0;
}
