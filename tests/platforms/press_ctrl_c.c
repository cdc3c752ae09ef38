/* Starts the command line in its first argument on the same console, presses Ctrl-C after five
   seconds, and ends with the exit code of the command. */
#include <windows.h>

int main(int count, char **arguments) {
    STARTUPINFOA start = {sizeof start};
    PROCESS_INFORMATION started;
    DWORD code = 1;
    if (count != 2 || !CreateProcessA(0, arguments[1], 0, 0, TRUE, 0, 0, 0, &start, &started)) {
        return 1;
    }
    Sleep(5000);
    SetConsoleCtrlHandler(0, TRUE);
    GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0);
    WaitForSingleObject(started.hProcess, 30000);
    GetExitCodeProcess(started.hProcess, &code);
    return (int)code;
}
