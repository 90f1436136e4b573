/* Firmware mistakes, each a small deviation from a right writer of frames (docs/look-up/wire-format.md, version 1).
 *
 *   mistakes MISTAKE SECONDS          records on standard output: double time [s], uint16 length, bytes
 *   mistakes MISTAKE SECONDS --port   the same bytes in real time on a pseudo-terminal, whose path is the first line
 *
 * What the mistake is called to a person stands in the test, not here.
 */
#define _GNU_SOURCE
#define _XOPEN_SOURCE 600
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static const char *mistake;
static int port = -1;
static struct timespec began;
static uint32_t random_state = 12345;

static int is(const char *name) { return strcmp(mistake, name) == 0; }

static uint32_t draw(void) {
    random_state = random_state * 1664525u + 1013904223u;
    return random_state >> 8;
}

static int noise(void) { return (int)(draw() % 3) - 1; }

static void emit(double when, const uint8_t *data, size_t length) {
    if (!length) return;
    if (port < 0) {
        uint16_t size = (uint16_t)length;
        fwrite(&when, sizeof when, 1, stdout);
        fwrite(&size, sizeof size, 1, stdout);
        fwrite(data, 1, length, stdout);
        return;
    }
    struct timespec due = began;
    due.tv_sec += (time_t)when;
    due.tv_nsec += (long)((when - (double)(time_t)when) * 1e9);
    if (due.tv_nsec >= 1000000000L) { due.tv_nsec -= 1000000000L; due.tv_sec++; }
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL)) {}
    if (write(port, data, length) < 0) return;  /* a reader that does not read: lost, as on a line */
}

/* ---- a line whose ends disagree: bits at the sender's rate, sampled at the receiver's */

static void over_line(double when, const uint8_t *data, size_t length, double sender, double receiver, int inverted) {
    static uint8_t line[1 << 13];
    static uint8_t received[1 << 12];
    size_t bits = 0, count = 0;
    line[bits++] = 1;
    for (size_t i = 0; i < length; i++) {
        line[bits++] = 0;
        for (int b = 0; b < 8; b++) line[bits++] = data[i] >> b & 1;
        line[bits++] = 1;
    }
    for (int i = 0; i < 400; i++) line[bits++] = 1;
    if (inverted) for (size_t i = 0; i < bits; i++) line[i] = !line[i];
    double step = sender / receiver, end = (double)bits - 12.0 * step;
    size_t k = 1;
    while ((double)k < end) {
        if (line[k] || !line[k - 1]) { k++; continue; }  /* a start bit is a falling edge */
        uint8_t byte = 0;
        for (int b = 0; b < 8; b++) byte |= (uint8_t)(line[(size_t)((double)k + (1.5 + b) * step)] << b);
        received[count++] = byte;
        k = (size_t)((double)k + 9.5 * step);
        while ((double)k < end && !line[k]) k++;  /* a framing error: the line has to be idle first */
        k++;
    }
    emit(when, received, count);
}

/* ---- checksums */

static uint16_t crc16(const uint8_t *data, size_t length, uint16_t crc, uint16_t polynomial) {
    for (size_t i = 0; i < length; i++) {
        crc ^= (uint16_t)(data[i] << 8);
        for (int b = 0; b < 8; b++) crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ polynomial : crc << 1);
    }
    return crc;
}

static uint16_t crc16_reflected(const uint8_t *data, size_t length, uint16_t crc, uint16_t polynomial) {
    for (size_t i = 0; i < length; i++) {
        crc ^= data[i];
        for (int b = 0; b < 8; b++) crc = (uint16_t)(crc & 1 ? crc >> 1 ^ polynomial : crc >> 1);
    }
    return crc;
}

static void put_crc(uint8_t *frame, size_t body) {
    static uint16_t before;
    uint16_t crc = crc16(frame, body, 0, 0x1021), right = crc;
    int low_first = is("crc low byte first");
    if (is("crc start ffff")) crc = crc16(frame, body, 0xFFFF, 0x1021);
    if (is("crc start 1d0f")) crc = crc16(frame, body, 0x1D0F, 0x1021);
    if (is("crc kermit")) { crc = crc16_reflected(frame, body, 0, 0x8408); low_first = 1; }
    if (is("crc x-25")) { crc = crc16_reflected(frame, body, 0xFFFF, 0x8408) ^ 0xFFFF; low_first = 1; }
    if (is("crc modbus")) { crc = crc16_reflected(frame, body, 0xFFFF, 0xA001); low_first = 1; }
    if (is("crc arc, high first")) crc = crc16_reflected(frame, body, 0, 0xA001);
    if (is("crc without sync")) crc = crc16(frame + 2, body - 2, 0, 0x1021);
    if (is("crc without header")) crc = crc16(frame + 4, body - 4, 0, 0x1021);
    if (is("crc over its own zeros")) { frame[body] = frame[body + 1] = 0; crc = crc16(frame, body + 2, 0, 0x1021); }
    if (is("crc never written")) crc = 0;
    if (is("crc of the frame before")) crc = before;
    if (is("crc before the sequence")) { static uint8_t old[2]; uint8_t copy[64]; memcpy(copy, frame, body);
        memcpy(copy + 8, old, 2); memcpy(old, frame + 8, 2); crc = crc16(copy, body, 0, 0x1021); }
    if (is("byte sum")) { crc = 0; for (size_t i = 0; i < body; i++) crc = (uint16_t)(crc + frame[i]); low_first = 1; }
    if (is("exclusive or")) { crc = 0; for (size_t i = 0; i < body; i++) crc ^= frame[i]; low_first = 1; }
    if (is("crc of 8 bits")) { uint8_t c = 0; for (size_t i = 0; i < body; i++) { c ^= frame[i];
        for (int b = 0; b < 8; b++) c = (uint8_t)(c & 0x80 ? c << 1 ^ 0x07 : c << 1); } crc = (uint16_t)(c << 8); }
    before = right;
    frame[body] = (uint8_t)(low_first ? crc : crc >> 8);
    frame[body + 1] = (uint8_t)(low_first ? crc >> 8 : crc);
}

/* ---- a frame */

static void put16(uint8_t *to, uint32_t value, int big) {
    to[big ? 1 : 0] = (uint8_t)value;
    to[big ? 0 : 1] = (uint8_t)(value >> 8);
}

static size_t write_frame(uint8_t *frame, uint32_t number, double when, uint8_t sensor, uint32_t sensors) {
    int big = is("big endian");
    uint16_t counts[10] = {2, 2, 1, 3, 2, 1127, 2, 3, 1842, 3102};
    uint32_t clock = (uint32_t)(when * 1e6 + 4000000000.0), sequence = number;
    uint8_t status = number == 0 ? 0x20 : 0;
    for (int k = 0; k < 10; k++) counts[k] = (uint16_t)(counts[k] + noise());
    if (is("supply 0")) counts[9] = 0;
    if (is("currents 0")) counts[2] = counts[5] = counts[8] = 0;
    if (is("radial current 0")) counts[5] = 0;
    if (is("angular current 0")) counts[8] = 0;
    if (is("shifted to 16 bits")) for (int k = 0; k < 10; k++) counts[k] = (uint16_t)(counts[k] << 4);
    if (is("scaled to 16 bits")) for (int k = 0; k < 10; k++) counts[k] = (uint16_t)(counts[k] * 65535u / 4095u);
    if (is("10 bits")) for (int k = 0; k < 10; k++) counts[k] = (uint16_t)(counts[k] / 4);
    if (is("millivolts")) for (int k = 0; k < 10; k++) counts[k] = (uint16_t)(counts[k] * 3300u / 4095u);
    if (is("negative counts")) { counts[0] = (uint16_t)(counts[0] - 5); counts[3] = (uint16_t)(counts[3] - 6); }
    if (is("supply first")) { uint16_t last = counts[9]; memmove(counts + 1, counts, 18); counts[0] = last; }
    if (is("phases exchanged")) { uint16_t swap = counts[5]; counts[5] = counts[8]; counts[8] = swap; }
    if (is("readings never change")) { uint16_t same[10] = {2, 2, 1, 3, 2, 1127, 2, 3, 1842, 3102};
        memcpy(counts, same, sizeof same); }
    if (is("supply written as a constant")) counts[9] = 3102;
    if (is("reference missing")) for (int k = 0; k < 10; k++) counts[k] = 4095;
    if (is("inputs float")) for (int k = 3; k < 8; k++) if (k != 5) counts[k] = (uint16_t)(200 + draw() % 400);
    if (is("clock in ms")) clock /= 1000;
    if (is("clock in ns")) clock = (uint32_t)(uint64_t)(when * 1e9);
    if (is("clock twice too fast")) clock = (uint32_t)(when * 2e6);
    if (is("clock in ticks of 4 us")) clock = (uint32_t)(when * 0.25e6);
    if (is("clock 3 % fast")) clock = (uint32_t)(when * 1.03e6);
    if (is("clock never written")) clock = 0;
    if (is("clock of 16 bits")) clock &= 0xFFFF;
    if (is("clock since the frame began")) clock = 300 + draw() % 200;
    if (is("sequence never written")) sequence = 7;
    if (is("sequence of 8 bits")) sequence &= 0xFF;
    if (is("sequence shared")) sequence = number * sensors + sensor;
    if (is("sequence is the clock")) sequence = clock >> 3;
    if (is("restarted in every frame")) status = 0x20;
    if (is("reserved bit")) status = 0x80;
    if (is("watchdog bites")) { sequence = number % 200; clock = (number % 200) * 1000; status = number % 200 ? 0 : 0x20; }
    if (is("self-test failed")) status = 0x08;
    frame[0] = 0xC5; frame[1] = 0x3A; frame[2] = 1; frame[3] = 36;
    if (is("sync exchanged")) { frame[0] = 0x3A; frame[1] = 0xC5; }
    if (is("another sync")) { frame[0] = 0xAA; frame[1] = 0x55; }
    if (is("version 0")) frame[2] = 0;
    if (is("version 3")) frame[2] = 3;
    if (is("version and length exchanged")) { frame[2] = 36; frame[3] = 1; }
    if (is("length without the crc")) frame[3] = 34;
    if (is("length of the content")) frame[3] = 30;
    put16(frame + 4, is("another device") ? 77 : 0, big);
    frame[6] = sensor;
    frame[7] = status;
    put16(frame + 8, sequence & 0xFFFF, big);
    uint8_t *to = frame + 10;
    if (is("padded struct")) { *to++ = 0; *to++ = 0; frame[3] = 40; }
    if (is("padded struct, 36 bytes sent")) { *to++ = 0; *to++ = 0; }
    for (int k = 0; k < 4; k++) to[k] = (uint8_t)(clock >> 8 * (big ? 3 - k : k));
    to += 4;
    int fields = is("a field is missing") ? 9 : 10;
    for (int k = 0; k < fields; k++, to += 2) put16(to, counts[k], big);
    size_t body = (size_t)(to - frame);
    put_crc(frame, body);
    size_t length = body + 2;
    if (is("no crc")) length = body;
    if (is("padded struct")) { frame[38] = frame[39] = 0; length = 40; }
    if (is("padded struct, 36 bytes sent")) length = 36;
    if (is("buffer of 32 bytes")) length = 32;
    if (is("written as a string")) length = strlen((char *)frame);
    return length;
}

/* ---- what is around the frame */

static size_t to_text(char *text, const uint8_t *frame, size_t length) {
    char *at = text;
    for (size_t i = 0; i < length; i++) at += sprintf(at, "%02X ", frame[i]);
    at += sprintf(at, "\r\n");
    return (size_t)(at - text);
}

static size_t to_base64(char *text, const uint8_t *frame, size_t length) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char *at = text;
    for (size_t i = 0; i < length; i += 3) {  /* 36 bytes: no padding */
        uint32_t three = (uint32_t)frame[i] << 16 | (uint32_t)frame[i + 1] << 8 | frame[i + 2];
        for (int k = 3; k >= 0; k--) *at++ = digits[three >> 6 * k & 63];
    }
    *at++ = '\n';
    return (size_t)(at - text);
}

static void send_frame(double when, uint8_t *frame, size_t length, uint32_t number) {
    uint8_t out[512];
    size_t n = 0;
    char *text = (char *)out;
    if (is("hexadecimal digits")) { emit(when, out, to_text(text, frame, length)); return; }
    if (is("base64")) { emit(when, out, to_base64(text, frame, length)); return; }
    if (is("decimal numbers")) {
        for (size_t i = 0; i < length; i++) n += (size_t)sprintf(text + n, "%u,", frame[i]);
        n += (size_t)sprintf(text + n, "\n");
    } else if (is("readings as text")) {
        n = (size_t)sprintf(text, "C=%d D=%d I=%d U=%d\r\n", 2, 3, 1127 + noise(), 3102 + noise());
    } else if (is("a print in every frame")) {
        memcpy(out, frame, length);
        n = length + (size_t)sprintf(text + length, "level=%d\r\n", 2 + noise());
    } else if (is("a line end behind the frame")) {
        memcpy(out, frame, length);
        out[length] = '\r'; out[length + 1] = '\n'; n = length + 2;
    } else if (is("slip")) {
        for (size_t i = 0; i < length; i++) {
            if (frame[i] == 0xC0) { out[n++] = 0xDB; out[n++] = 0xDC; }
            else if (frame[i] == 0xDB) { out[n++] = 0xDB; out[n++] = 0xDD; }
            else out[n++] = frame[i];
        }
        out[n++] = 0xC0;
    } else if (is("cobs")) {
        size_t code = n++;
        uint8_t run = 1;
        for (size_t i = 0; i < length; i++) {
            if (frame[i]) { out[n++] = frame[i]; run++; }
            else { out[code] = run; code = n++; run = 1; }
        }
        out[code] = run; out[n++] = 0;
    } else if (is("text mode")) {
        for (size_t i = 0; i < length; i++) { if (frame[i] == '\n') out[n++] = '\r'; out[n++] = frame[i]; }
    } else if (is("xon/xoff")) {
        for (size_t i = 0; i < length; i++) if (frame[i] != 0x11 && frame[i] != 0x13) out[n++] = frame[i];
    } else if (is("zeros left out")) {
        for (size_t i = 0; i < length; i++) if (frame[i]) out[n++] = frame[i];
    } else if (is("seven bits")) {
        for (size_t i = 0; i < length; i++) out[n++] = frame[i] & 0x7F;
    } else if (is("inverted bytes")) {
        for (size_t i = 0; i < length; i++) out[n++] = (uint8_t)~frame[i];
    } else if (is("bits reversed")) {
        for (size_t i = 0; i < length; i++) {
            uint8_t byte = 0;
            for (int b = 0; b < 8; b++) byte |= (uint8_t)((frame[i] >> b & 1) << (7 - b));
            out[n++] = byte;
        }
    } else if (is("buffer changes while it is sent")) {
        memcpy(out, frame, length); n = length;
        if (number % 3 == 0) { put16(out + 26, 17, 0); put16(out + 28, (uint32_t)(400 + noise()), 0); }
    } else if (is("noise on the line")) {
        memcpy(out, frame, length); n = length;
        if (number % 4 == 0) out[draw() % length] ^= (uint8_t)(1u << draw() % 8);
    } else if (is("receive buffer overflows")) {
        size_t lost = number % 3 ? length : draw() % length;
        for (size_t i = 0; i < length; i++) if (i < lost || i > lost + draw() % 9) out[n++] = frame[i];
    } else {
        double sender = is("2 times faster") ? 2000000 : is("2 times slower") ? 460800 : is("8 times slower") ? 115200
            : is("96 times slower") ? 9600 : is("8 times faster") ? 7372800 : is("inverted line") ? 921600 : 0;
        if (sender > 0.0) { over_line(when, frame, length, sender, 921600, is("inverted line")); return; }
        memcpy(out, frame, length); n = length;
    }
    emit(when, out, n);
}

static void other_device(double when, uint32_t number) {
    uint8_t out[256];
    char *text = (char *)out;
    size_t n = 0;
    if (is("a satellite receiver")) {
        uint8_t sum = 0;
        n = (size_t)sprintf(text, "$GPRMC,%06u,V,,,,,,,010100,,,N", number % 240000);
        for (size_t i = 1; i < n; i++) sum ^= out[i];
        n += (size_t)sprintf(text + n, "*%02X\r\n", sum);
    } else if (is("modbus")) {
        uint8_t message[8] = {1, 3, 0, (uint8_t)number, 0, 2, 0, 0};
        uint16_t crc = crc16_reflected(message, 6, 0xFFFF, 0xA001);
        message[6] = (uint8_t)crc; message[7] = (uint8_t)(crc >> 8);
        memcpy(out, message, 8); n = 8;
    } else if (is("mavlink")) {
        out[n++] = 0xFE; out[n++] = 9; out[n++] = (uint8_t)number; out[n++] = 1; out[n++] = 1; out[n++] = 0;
        for (int k = 0; k < 11; k++) out[n++] = (uint8_t)draw();
    } else if (is("random bytes")) {
        for (n = 0; n < 40; n++) out[n] = (uint8_t)draw();
    } else if (is("zeros")) {
        memset(out, 0, n = 90);
    } else if (is("the byte 55")) {
        memset(out, 0x55, n = 30);
    } else if (is("only a banner") && number == 0) {
        n = (size_t)sprintf(text, "boot\r\nads1115 not found on 0x48\r\nhalt\r\n");
    }
    emit(when, out, n);
}

int main(int argc, char **argv) {
    if (argc < 3) { fprintf(stderr, "mistakes MISTAKE SECONDS [--port]\n"); return 2; }
    static const char *const others[] = {"a satellite receiver", "modbus", "mavlink", "random bytes", "zeros", "the byte 55",
        "only a banner", "nothing"};
    mistake = argv[1];
    double seconds = atof(argv[2]), period = 0.001;
    int foreign = 0;
    uint32_t sensors = is("sequence shared") ? 2 : 1;
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) foreign |= is(others[k]);
    if (foreign) period = is("a satellite receiver") ? 0.1 : 0.02;
    if (is("zeros")) period = 0.001;
    if (is("9600 baud")) period = 0.0375;
    if (is("96 times slower")) period = 0.04;
    if (is("8 times slower")) period = 0.0035;
    if (argc > 3) {
        port = posix_openpt(O_RDWR | O_NOCTTY);
        if (port < 0 || grantpt(port) || unlockpt(port)) { perror("pseudo-terminal"); return 1; }
        int other = open(ptsname(port), O_RDWR | O_NOCTTY);
        struct termios raw;
        tcgetattr(other, &raw); cfmakeraw(&raw); tcsetattr(other, TCSANOW, &raw);
        printf("%s\n", ptsname(port)); fflush(stdout);
        close(other);
        struct pollfd reader = {port, 0, 0};
        for (;;) {  /* until somebody opens the port */
            poll(&reader, 1, 0);
            if (!(reader.revents & POLLHUP)) break;
            usleep(2000);
        }
        usleep(50000);
        fcntl(port, F_SETFL, O_NONBLOCK);
        clock_gettime(CLOCK_MONOTONIC, &began);
    }
    uint32_t number = 0;
    uint8_t frame[128], bundle[4096];
    size_t held = 0;
    for (double when = 0.0; when < seconds; when += period, number++) {
        if (foreign) { other_device(when, number); continue; }
        if (is("hangs after a while") && when > 0.4) break;
        for (uint32_t sensor = 0; sensor < sensors; sensor++) {
            const int silent = is("every twentieth frame is dropped uncounted");
            size_t length = write_frame(frame, silent ? number - number / 20 : number, when, (uint8_t)sensor, sensors);
            if (is("every frame twice")) { send_frame(when, frame, length, number); send_frame(when, frame, length, number); }
            else if (is("held back for 16 ms")) {
                memcpy(bundle + held, frame, length); held += length;
                if (number % 16 == 15) { emit(when, bundle, held); held = 0; }
            }
            else if (is("every fiftieth frame twice") && number % 50 == 1) { send_frame(when, frame, length, number); send_frame(when, frame, length, number); }
            else if (is("every fourth frame is lost") && number % 4 == 1) {}
            else if (silent && number % 20 == 19) {}
            else send_frame(when, frame, length, number);
        }
    }
    if (port >= 0) {  /* the reader goes first: what it has not read would be lost with the port */
        struct pollfd reader = {port, 0, 0};
        for (int k = 0; k < 2500; k++) { poll(&reader, 1, 0); if (reader.revents & POLLHUP) break; usleep(2000); }
    }
    return 0;
}
