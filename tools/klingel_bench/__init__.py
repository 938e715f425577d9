"""The CAN bench of Klingel; see tools/bench.py.

database    the DBC: what each message looks like, and which of it the checks need
protection  CRC-8 SAE J1850 and alive counters
transport   python-can underneath: connecting, the receiving thread, how a bus goes away
monitor     every frame by its bytes: counters, CRC, cycle times; samples for the picture
commands    run control with acknowledge, the cyclic set-point, the script
candump     the log
table       the live table
picture     the PNG
verdict     what it all comes to
app         the command line and the loop
"""
