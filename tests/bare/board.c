/* A board for the firmware: frames come in the order of a script, and what the firmware sends is printed as
 * candump would. Written against the contract of src/lib.rs. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct can_frame {
    uint16_t id;
    bool is_remote;
    uint8_t len;
    uint8_t data[8];
};

struct board {
    uint64_t (*now_us)(void);
    bool (*receive)(struct can_frame *);
    void (*send)(const struct can_frame *);
    bool (*is_powered)(void);
};

bool bare_run(const struct board *board, uint8_t node);

static const struct can_frame script[] = {
    {0x605, false, 8, {0x40, 0x00, 0x10, 0x00}},                         /* read 1000h */
    {0x605, false, 8, {0x23, 0x7A, 0x60, 0x00, 0x88, 0x13, 0x00, 0x00}}, /* write 5000 to 607Ah */
    {0x605, false, 8, {0x40, 0x64, 0x60, 0x00}},                         /* read 6064h */
    {0x000, false, 2, {0x82, 0x05}},                                     /* reset communication */
};
static const unsigned frames = sizeof script / sizeof *script;

static unsigned received;
static uint64_t time_us;

static uint64_t now_us(void) {
    return time_us;
}

static bool receive(struct can_frame *frame) {
    time_us += 1000;
    if (received == frames) {
        received++;
        return false;
    }
    *frame = script[received++];
    return true;
}

static void send(const struct can_frame *frame) {
    printf("%03X#", frame->id);
    for (unsigned at = 0; at < frame->len; at++) {
        printf("%02X", frame->data[at]);
    }
    printf("\n");
}

static bool is_powered(void) {
    return received <= frames;
}

int main(void) {
    const struct board board = {now_us, receive, send, is_powered};
    return bare_run(&board, 5) ? 0 : 1;
}
