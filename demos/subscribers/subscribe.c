/* Print what `coneskin guard scene.toml --publish udp://127.0.0.1:9870` publishes: cc subscribe.c && ./a.out 9870 */
#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int count, char **words) {
    int port = count > 1 ? atoi(words[1]) : 9870, receiver = socket(AF_INET, SOCK_DGRAM, 0);
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof at;
    if (bind(receiver, (struct sockaddr *)&at, size) || getsockname(receiver, (struct sockaddr *)&at, &size)) return 1;
    printf("listening %d\n", ntohs(at.sin_port));
    char event[65536] = "";
    while (fflush(stdout) == 0 && !strstr(event, "\"name\":\"ending\"")) {
        ssize_t length = recv(receiver, event, sizeof event - 1, 0);
        event[length > 0 ? length : 0] = 0;
        puts(event);
    }
}
