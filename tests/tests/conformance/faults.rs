//! Devices that are wrong in one thing each, and the cases that notice. The device has node-ID 5.

use lexican_conform::Case;

use crate::faulty::State::{Operational, PreOperational, Stopped};
use crate::faulty::{Fault, every_ms, fault, heard, sent};

/// The event timer of RPDO 1 is 100 ms.
const DEADLINE: &[&str] = &["605#2B00140564*"];
const NO_DEADLINE: &str = "605#2B0014050000*";
const LATE: &str = "085#5082110000000000";

pub const FAULTS: &[Fault] = &[
    Fault {
        title: "the data sheet counts an RPDO too many",
        rules: &[],
        sheet: Some(("NrOfRXPDO=3", "NrOfRXPDO=4")),
        fails: "306-1/6/2",
    },
    Fault { title: "the data sheet has no device type", rules: &[], sheet: Some(("[1000]", "[1F99]")), fails: "1.0" },
    // SDO.
    fault(
        "1000h has another value",
        &[sent("585#4300100092010000").becomes("585#4300100093010000")],
        "2.1 2.19 4.2 4.8",
    ),
    fault(
        "1015h forgets what is written",
        &[heard("605#2B151000*").is_answered("585#6015100000000000")],
        "2.2 301/7.5.2.18/1 301/7.5.2.14/5 301/7.3.2.2.1/2",
    ),
    fault("1000h is written", &[heard("605#23001000*").is_answered("585#6000100000000000")], "2.3 4.3 4.7"),
    fault(
        "1000h is read-only with the wrong abort code",
        &[sent("585#8000100002000106").becomes("585#8000100011000906")],
        "2.3 4.3 4.7",
    ),
    fault("2001h is read", &[heard("605#40012000*").is_answered("585#4301200000000000")], "2.4 4.4 4.7"),
    fault("1000h:01 exists", &[heard("605#40001001*").is_answered("585#4300100100000000")], "2.5 306-1/6.5.2/11"),
    fault("1004h exists", &[heard("605#40041000*").is_answered("585#4304100000000000")], "2.6 306-1/6.5.2/11"),
    fault("an unknown command is not answered", &[heard("605#E0*")], "2.7"),
    fault("1017h takes four bytes", &[heard("605#23171000*").becomes("605#2B171000*")], "2.8"),
    fault("1017h takes one byte", &[heard("605#2F171000*").becomes("605#2B171000*")], "2.9"),
    fault(
        "2002h takes a value above its limit",
        &[heard("605#2B022000C900*").is_answered("585#6002200000000000")],
        "2.10 4.6",
    ),
    fault(
        "2002h takes a value below its limit",
        &[heard("605#2B0220000900*").is_answered("585#6002200000000000")],
        "2.11 4.6",
    ),
    fault("2002h refuses its largest value", &[heard("605#2B022000C800*").is_answered("585#8002200031000906")], "4.6"),
    fault(
        "1200h has another identifier",
        &[sent("585#4300120105060000").becomes("585#4300120106060000")],
        "2.12 4.2 4.8",
    ),
    fault(
        "a segment is sent of a value that came at once",
        &[heard("605#60*").is_answered("585#0192010000000000").after(&["605#40001000*"]).until("605#400810*")],
        "2.13",
    ),
    fault("100Ch is not written in segments", &[heard("605#210C1000*").is_answered("585#800C100000000106")], "2.14"),
    fault("1017h is not written in segments", &[heard("605#21171000*").is_answered("585#8017100000000106")], "2.15"),
    fault(
        "1008h announces one byte too many",
        &[sent("585#410810000B*").becomes("585#410810000C*")],
        "2.16 2.18 4.1 4.2 4.3 4.7 4.8 306-1/6.5.2/12 301/7.2.4.3/2",
    ),
    fault(
        "a wrong toggle bit is not noticed",
        &[heard("605#70*").becomes("605#60*").after(&["605#40081000*"]).until("605#60*")],
        "2.17",
    ),
    fault(
        "a wrong toggle bit is not noticed while segments are written",
        &[heard("605#1B*").becomes("605#0B*").after(&["605#21171000*"])],
        "301/7.2.4.3.5/1",
    ),
    fault(
        "a segment follows the last one",
        &[heard("605#60*").is_answered("585#0100000000000000").after(&["585#17*"]).until("605#40*")],
        "2.18",
    ),
    fault("1000h is not read as a block", &[heard("605#A0001000*").is_answered("585#8000100001000405")], "2.19"),
    fault(
        "100Ch is not written as a block without checksum",
        &[heard("605#C20C1000*").is_answered("585#800C100001000405")],
        "2.20",
    ),
    fault(
        "1017h is not written as a block without checksum",
        &[heard("605#C2171000*").is_answered("585#8017100001000405")],
        "2.21 301/7.2.4.3.9/3",
    ),
    fault(
        "100Ch is not written as a block with checksum",
        &[heard("605#C60C1000*").is_answered("585#800C100001000405")],
        "2.24",
    ),
    fault(
        "1017h is not written as a block with checksum",
        &[heard("605#C6171000*").is_answered("585#8017100001000405")],
        "2.25",
    ),
    fault(
        "a block without checksum has a wrong byte",
        &[sent("585#01*").becomes("585#0154*").after(&["605#A0081000*"]).until("605#A1*")],
        "2.22 301/7.2.4.3.14/4",
    ),
    fault(
        "the checksum of a block is wrong",
        &[sent("585#C.*").becomes("585#C.FFFF*").after(&["605#A2*"]).until("605#A1*")],
        "2.23",
    ),
    fault("a wrong checksum is not noticed", &[heard("605#D5FFFF*").is_answered("585#A100000000000000")], "2.24 2.25"),
    fault("a block of 128 segments begins", &[heard("605#A008100080*").becomes("605#A00810007F*")], "2.26"),
    fault("segment 128 is confirmed", &[heard("605#A280*").becomes("605#A202*")], "2.27"),
    fault(
        "1201h:03 is not read",
        &[heard("605#40011203*").is_answered("585#8001120300000008")],
        "2.28 2.29 4.1 4.2 4.7 4.8 4.9",
    ),
    fault(
        "1201h stays as it was written, over a reset",
        &[heard("605#40011201*").is_answered("585#43011201C0060000").after(&["000#8205"])],
        "2.29",
    ),
    fault("the second server does not answer", &[heard("6C0#*")], "2.29"),
    fault(
        "1280h is not stored",
        &[heard("605#40801201*").is_answered("585#4380120100000080").after(&["000#8205"])],
        "2.30",
    ),
    // PDOs.
    fault("1401h:02 is not read", &[heard("605#40011402*").is_answered("585#8001140200000008")], "3.1 4.1 4.2 4.7 4.8"),
    fault(
        "1802h:03 is not read",
        &[heard("605#40021803*").is_answered("585#8002180300000008")],
        "3.2 3.5 3.11 3.17 4.1 4.2 4.7 4.8 4.9",
    ),
    fault("a remote frame does not ask for TPDO 1", &[heard("185#R*")], "3.3 9.3 301/7.2.2.3/4 301/7.2.2.3/7"),
    fault(
        "an event sends the old value",
        &[sent("185#*").becomes("185#3412").after(&["605#2B032000*"])],
        "3.4 301/7.2.2.3/7",
    ),
    fault(
        "the event timer takes twice its time",
        &[sent("185#*").comes_half_as_often().after(&["605#2B00180564*"])],
        "3.5 301/7.2.2.3/5",
    ),
    fault(
        "TPDO 1 comes with every sixth SYNC",
        &[sent("185#*").comes_half_as_often().after(&["605#2F00180203*"])],
        "3.6",
    ),
    fault(
        "every second event is not sent with SYNC",
        &[sent("185#*").comes_half_as_often().after(&["605#2F00180200*"])],
        "3.7",
    ),
    fault(
        "the SYNC start value does not matter",
        &[heard("605#2F00180605*").becomes("605#2F00180600*")],
        "3.8 301/7.5.2.37/9",
    ),
    fault("STOPPED: a remote frame is answered", &[heard("185#R*").brings("185#3412").when(Stopped)], "3.9 9.4"),
    fault("STOPPED: an event is sent", &[every_ms(10, "185#3412").when(Stopped).after(&["605#2F001802FF*"])], "3.10"),
    fault(
        "STOPPED: the event timer runs",
        &[every_ms(100, "185#3412").when(Stopped).after(&["605#2B00180564*"])],
        "3.11",
    ),
    fault(
        "STOPPED: a TPDO comes with SYNC",
        &[heard("080#").brings("185#3412").when(Stopped).after(&["605#2F00180203*"])],
        "3.12",
    ),
    fault(
        "STOPPED: an event is sent with SYNC",
        &[heard("080#").brings("185#3412").when(Stopped).after(&["605#2F00180200*"])],
        "3.13",
    ),
    fault("STOPPED: a TPDO comes with the start value", &[heard("080#05").brings("185#3412").when(Stopped)], "3.14"),
    fault(
        "PRE-OPERATIONAL: a remote frame is answered",
        &[heard("185#R*").brings("185#3412").when(PreOperational)],
        "3.15 9.2",
    ),
    fault(
        "PRE-OPERATIONAL: an event is sent",
        &[every_ms(10, "185#3412").when(PreOperational).after(&["605#2F001802FF*"])],
        "3.16",
    ),
    fault(
        "PRE-OPERATIONAL: the event timer runs",
        &[every_ms(100, "185#3412").when(PreOperational).after(&["605#2B00180564*"])],
        "3.17",
    ),
    fault(
        "PRE-OPERATIONAL: a TPDO comes with SYNC",
        &[heard("080#").brings("185#3412").when(PreOperational).after(&["605#2F00180203*"])],
        "3.18",
    ),
    fault(
        "PRE-OPERATIONAL: an event is sent with SYNC",
        &[heard("080#").brings("185#3412").when(PreOperational).after(&["605#2F00180200*"])],
        "3.19",
    ),
    fault(
        "PRE-OPERATIONAL: a TPDO comes with the start value",
        &[heard("080#05").brings("185#3412").when(PreOperational)],
        "3.20",
    ),
    fault(
        "TPDO 1 maps another object than the data sheet",
        &[sent("585#43001A0110004160").becomes("585#43001A0110004060")],
        "3.21 3.30 4.2 4.8 4.9",
    ),
    fault(
        "TPDO 1 sends what was mapped before",
        &[sent("185#*").becomes("185#3412").after(&["605#23001A0120006460"])],
        "3.22",
    ),
    fault(
        "a mapping is changed while it counts",
        &[heard("605#23001A01*").is_answered("585#60001A0100000000").after(&["605#23001801*"]).until("605#2F001A00*")],
        "3.23",
    ),
    fault(
        "a mapping is changed while the PDO exists",
        &[heard("605#2F001A0000*").is_answered("585#60001A0000000000").until("605#23001801*")],
        "3.24",
    ),
    fault("65 objects are mapped", &[heard("605#2F001A0041*").is_answered("585#60001A0000000000")], "3.25"),
    fault("more than eight bytes are mapped", &[heard("605#2F001A0003*").is_answered("585#60001A0000000000")], "3.26"),
    fault("an output is not received", &[heard("605#2300160120007A60").is_answered("585#8000160141000406")], "3.27"),
    fault("an input is received", &[heard("605#2300160120006460").is_answered("585#6000160100000000")], "3.28"),
    fault("2001h is received", &[heard("605#2300160120000120").is_answered("585#6000160100000000")], "3.29"),
    fault(
        "an input is not transmitted",
        &[heard("605#23001A0120006460").is_answered("585#80001A0141000406")],
        "3.22 3.30",
    ),
    fault("an output is transmitted", &[heard("605#23001A0120007A60").is_answered("585#60001A0100000000")], "3.31"),
    fault("2001h is transmitted", &[heard("605#23001A0120000120").is_answered("585#60001A0100000000")], "3.32"),
    fault(
        "a placeholder is not received",
        &[heard("605#2300160108000500").is_answered("585#8000160141000406")],
        "3.33",
    ),
    // The dictionary.
    fault("1018h:04 is not read", &[heard("605#40181004*").is_answered("585#8018100424000008")], "4.1 4.2 4.7 4.8"),
    fault(
        "2005h:01 has another value than the data sheet",
        &[sent("585#4B05200107000000").becomes("585#4B05200108000000")],
        "4.2",
    ),
    fault("1001h is written", &[heard("605#2F011000*").is_answered("585#6001100000000000")], "4.3 4.7"),
    fault("2005h:FF describes a VAR", &[sent("585#430520FF09*").becomes("585#430520FF07*")], "4.2 4.5"),
    fault(
        "1018h is not read in OPERATIONAL",
        &[heard("605#40181001*").is_answered("585#8018100122000008").when(Operational)],
        "4.7 306-1/6.5.2/12",
    ),
    fault(
        "2000h:03, of eight bytes, is not written",
        &[heard("605#21002003*").is_answered("585#8000200300000008")],
        "4.9",
    ),
    // Emergencies.
    fault(
        "1014h has another identifier",
        &[sent("585#4314100085000000").becomes("585#4314100086000000")],
        "4.2 4.8 4.9 5.1 5.4 5.5 5.6 301/7.5.2.4/3 301/7.5.2.17/2 301/7.5.2.18/1 7.6 7.106 301/7.2.2.1/4 301/7.5.2.35/3 301/7.2.5/3 301/7.2.2.1/2",
    ),
    fault(
        "1001h shows an error that there is not",
        &[sent("585#4F01100000*").becomes("585#4F01100001*")],
        "3.22 5.2 7.107 301/7.5.2.2/3",
    ),
    fault(
        "1003h has an error that has not occurred",
        &[heard("605#40031001*").is_answered("585#4303100120310000").until("605#23042000*")],
        "5.3",
    ),
    fault(
        "an emergency is sent twice",
        &[sent("085#*").brings("085#*")],
        "5.4 5.5 5.6 301/7.5.2.4/3 301/7.5.2.17/2 301/7.5.2.18/1 7.6 7.106 301/7.2.7/2 301/7.2.2.1/4 301/7.5.2.35/3 301/7.2.5/3 301/7.2.2.1/2",
    ),
    fault("1001h does not show what the emergency did", &[sent("585#4F01100005*").becomes("585#4F01100001*")], "5.5"),
    fault(
        "1003h has another error",
        &[sent("585#430310012031ABCD").becomes("585#430310012131ABCD")],
        "5.6 301/7.5.2.4/3",
    ),
    // SYNC.
    fault("1005h has another identifier", &[sent("585#4305100080*").becomes("585#4305100081*")], "4.2 4.8 6.1"),
    fault(
        "SYNC comes half as often",
        &[sent("080#*").comes_half_as_often()],
        "6.2 301/7.2.5/2 6.3 6.6 6.7 6.10 9.2 9.3",
    ),
    fault(
        "a TPDO comes with every SYNC",
        &[heard("605#2F00180202*").becomes("605#2F00180201*")],
        "3.8 6.3 301/7.5.2.37/3 301/7.2.2.2/4",
    ),
    fault("a SYNC consumer wants a period", &[heard("080#*").after(&["605#2306100000000000"])], "6.4"),
    fault("the counter overflow may be 241", &[heard("605#2F191000F1*").is_answered("585#6019100000000000")], "6.5"),
    fault("a counter comes without overflow", &[sent("080#").becomes("080#01").after(&["605#2F19100000*"])], "6.6"),
    fault("the counter leaves out a number", &[sent("080#03").becomes("080#04")], "6.7"),
    fault(
        "the counter overflow is not stored",
        &[heard("605#40191000*").is_answered("585#4F19100000000000").after(&["605#23101001*"])],
        "6.8",
    ),
    fault(
        "the counter overflow changes in spite of a period",
        &[heard("605#2F1910000A*").is_answered("585#6019100000000000").after(&["605#2306100010270000"])],
        "6.9",
    ),
    fault("a SYNC producer is not stored", &[sent("080#*").after(&["605#23101001*"])], "6.10"),
    // Error control.
    fault(
        "100Ch has another value than the data sheet",
        &[sent("585#4B0C100000000000").becomes("585#4B0C100001000000")],
        "4.2 4.8 7.1",
    ),
    fault(
        "a guarding request is not answered",
        &[heard("705#R*")],
        "7.2 7.3 7.4 7.6 7.203 301/7.2.8.3.2.1/5 9.2 9.3 9.4",
    ),
    fault("the toggle bit stays", &[sent("705#F.").becomes("705#7.")], "7.3 7.203 301/7.2.8.3.2.1/5"),
    fault(
        "the toggle bit goes on over a reset",
        &[sent("705#7F").becomes("705#FF").after(&["000#8205"])],
        "7.3 9.2 10.1",
    ),
    fault("a request to another node is answered", &[heard("706#R*").brings("706#7F")], "7.4"),
    fault("100Dh is not written", &[heard("605#2F0D1000*").is_answered("585#600D100000000000")], "7.5 7.6 9.3"),
    fault("life guarding notices nothing", &[sent("085#3081*").after(&["605#2F0D100002*"])], "7.6"),
    fault(
        "life guarding does not wait for the first request",
        &[every_ms(200, "085#3081110000000000").after(&["605#2F0D100002*"]).until("705#R1")],
        "7.6",
    ),
    fault("1017h has not what was written", &[sent("585#4B17100064*").becomes("585#4B17100063*")], "7.101"),
    fault(
        "the heartbeat comes half as often",
        &[sent("705#7F").comes_half_as_often().after(&["605#2B17100064*"])],
        "7.102 7.103 7.204 7.206 301/7.2.8.3.2.2/7 9.2 301/7.2.8.3.2.2/6",
    ),
    fault(
        "the heartbeat has another state",
        &[sent("705#7F").becomes("705#05").after(&["605#2B17100064*"])],
        "7.102 7.206 301/7.2.8.3.2.2/7 9.2 10.2 10.3 10.4 301/7.2.8.3.1/1",
    ),
    fault(
        "the heartbeat is not switched off",
        &[heard("605#2B17100000*").is_answered("585#6017100000000000")],
        "7.103",
    ),
    fault("a node is consumed twice", &[heard("605#23161002*").is_answered("585#6016100200000000")], "7.104"),
    fault(
        "a heartbeat is waited for half as long",
        &[heard("605#2316100164001000").becomes("605#2316100132001000")],
        "7.105 7.106",
    ),
    fault(
        "a heartbeat is waited for twice as long",
        &[heard("605#2316100164001000").becomes("605#23161001C8001000")],
        "7.106",
    ),
    fault(
        "a heartbeat is waited for after a reset",
        &[heard("000#8105").brings("085#3081110000000000").after(&["710#05"])],
        "7.107",
    ),
    fault(
        "100Dh is not read",
        &[heard("605#400D1000*").is_answered("585#800D100024000008")],
        "4.1 4.2 4.7 4.8 4.9 7.1 7.5 7.201",
    ),
    fault(
        "a heartbeat comes that is switched off",
        &[every_ms(100, "705#7F").after(&["605#2B17100000*"])],
        "7.103 7.202 7.203",
    ),
    fault(
        "without heartbeat, guarding requests are not answered",
        &[heard("705#R*").after(&["605#2B17100000*"]).until("000#81*")],
        "7.203",
    ),
    fault(
        "no heartbeat comes without guarding",
        &[sent("705#7F").when(PreOperational).after(&["605#2B17100064*"]).until("605#2F0D*")],
        "7.102 7.103 7.204 7.205 7.206 7.207 301/7.2.8.3.2.2/7 9.2 10.1 10.2 10.3 10.4 301/7.2.8.3.1/1 301/7.2.8.3.2.2/6",
    ),
    fault(
        "with a heartbeat, guarding requests are answered",
        &[heard("705#R*").brings("705#7F").after(&["605#2B17100064*"]).until("605#2B17100000*")],
        "7.205 7.207",
    ),
    fault(
        "with guarding, the heartbeat comes half as often",
        &[sent("705#7F").comes_half_as_often().after(&["605#2F0D100002*", "605#2B17100064*"])],
        "7.206 9.2",
    ),
    fault(
        "with both, guarding requests are answered",
        &[heard("705#R*").brings("705#7F").after(&["605#2F0D100002*", "605#2B17100064*"])],
        "7.207 9.3",
    ),
    // Storing.
    fault("1010h:01 takes any signature", &[heard("605#2310100165766173").is_answered("585#6010100100000000")], "8.1"),
    fault(
        "1010h:01 stores nothing",
        &[heard("605#2310100173617665").is_answered("585#6010100100000000")],
        "2.30 6.8 6.10 8.2 8.4 8.9",
    ),
    fault("1011h:01 takes any signature", &[heard("605#231110016461*").is_answered("585#6011100100000000")], "8.3"),
    fault(
        "1011h:01 restores nothing",
        &[heard("605#231110016C6F6164").is_answered("585#6011100100000000")],
        "8.4 301/7.5.2.14/5",
    ),
    fault("1010h:02 takes any signature", &[heard("605#2310100265766173").is_answered("585#6010100200000000")], "8.5"),
    fault("1010h:02 stores nothing", &[heard("605#2310100273617665").is_answered("585#6010100200000000")], "8.6 8.8"),
    fault("1011h:02 takes any signature", &[heard("605#231110026461*").is_answered("585#6011100200000000")], "8.7"),
    fault("1011h:02 restores nothing", &[heard("605#231110026C6F6164").is_answered("585#6011100200000000")], "8.8"),
    fault(
        "1011h:01 restores at once",
        &[heard("605#40171000*").is_answered("585#4B17100000000000").after(&["605#23111001*"])],
        "8.4",
    ),
    fault(
        "1020h is not stored",
        &[heard("605#40201001*").is_answered("585#4320100100000000").after(&["605#23101001*"])],
        "8.9",
    ),
    fault(
        "a PDO takes an identifier of SDO",
        &[heard("605#2300180181050000").is_answered("585#6000180100000000")],
        "8.10",
    ),
    // NMT.
    fault(
        "emergencies are those of node 1",
        &[sent("085#*").becomes("081#*"), sent("585#4314100085*").becomes("585#4314100081*")],
        "4.2 4.8 4.9 5.1 301/7.2.7/2",
    ),
    fault("there is no boot-up message", &[sent("705#00")], "9.1 9.2 10.1 301/7.3.2.2.2/7"),
    fault(
        "1017h has not its default after a reset",
        &[heard("605#40171000*").is_answered("585#4B171000E8030000").after(&["605#2B171000E803*"]).until("605#2310*")],
        "301/7.3.2.2.1/2 9.1",
    ),
    fault(
        "PRE-OPERATIONAL: an RPDO is taken",
        &[heard("605#40406000*").is_answered("585#4B40600001010000").after(&["000#8005", "205#*"]).until("000#0*")],
        "9.2",
    ),
    fault(
        "STOPPED: an RPDO is taken",
        &[heard("605#40406000*").is_answered("585#4B40600001010000").after(&["000#0205", "205#*"]).until("000#01*")],
        "9.4",
    ),
    fault(
        "OPERATIONAL: an RPDO is not taken",
        &[heard("205#*")],
        "9.3 301/7.2.2.2/5 301/7.2.2.1/5 301/7.2.2.1/3 301/7.2.2.1/4 301/7.5.2.35/3 301/7.2.2.1/2",
    ),
    fault("1029h:01 = 2 does not lead to STOPPED", &[heard("605#2F29100102*").becomes("605#2F29100100*")], "9.3"),
    fault("STOPPED: SYNC is produced", &[every_ms(10, "080#").when(Stopped).after(&["605#2305100080000040"])], "9.4"),
    fault("STOPPED: SDO is answered", &[heard("605#40001000*").brings("585#4300100092010000").when(Stopped)], "9.4"),
    fault(
        "PRE-OPERATIONAL: SYNC is not produced",
        &[sent("080#").when(PreOperational)],
        "6.2 301/7.2.5/2 6.6 6.10 9.2",
    ),
    fault("a reset of another node is obeyed", &[heard("000#8106").becomes("000#8105")], "10.1"),
    fault("a reset of all nodes is not obeyed", &[heard("000#8200")], "10.1"),
    fault("a reset of the communication is one of the node", &[heard("000#8205").becomes("000#8105")], "10.1"),
    fault("PRE-OPERATIONAL is not entered with all nodes", &[heard("000#8000")], "10.2"),
    fault("OPERATIONAL is not entered with all nodes", &[heard("000#0100")], "10.3"),
    fault("OPERATIONAL is entered with another node", &[heard("000#0106").becomes("000#0105")], "10.3"),
    fault("STOPPED is not entered with all nodes", &[heard("000#0200")], "10.4"),
    fault(
        "STOPPED is reported as PRE-OPERATIONAL",
        &[sent("705#.4").becomes("705#7F")],
        "301/7.2.8.3.2.1/5 301/7.2.8.3.2.2/7 9.3 9.4 10.2 10.3 10.4",
    ),
    // Beyond the plan.
    fault("a request of one byte is answered", &[heard("605#40").is_answered("585#4300100092010000")], "301/7.2.4.3/1"),
    fault(
        "nothing is read while segments are sent",
        &[heard("605#40001000*").after(&["605#40081000*"]).until("605#60*")],
        "2.17 301/7.2.4.3/2",
    ),
    fault(
        "an abort is answered",
        &[heard("605#80*").brings("585#8000100000000008")],
        "301/7.2.4.3.9/3 301/7.2.4.3/2 301/7.2.4.3.17/10",
    ),
    fault(
        "segments that were lost count as confirmed",
        &[heard("605#A201*").becomes("605#A202*")],
        "2.19 301/7.2.4.3.14/3 301/7.2.4.3.14/4",
    ),
    fault(
        "the server is deaf after sixty reads",
        &[heard("605#40001000*").after(&["605#40001000*"; 60])],
        "301/7.2.4.3/3 301/7.2.4.3/4",
    ),
    fault("the server is deaf after command 5Fh", &[heard("605#40001000*").after(&["605#5F*"])], "301/7.2.4.3/4"),
    fault("a remote frame is answered by SDO", &[heard("605#R8").brings("585#4300100092010000")], "301/7.2.4.3/5"),
    fault("NMT command 3 is obeyed as a stop", &[heard("000#0305").becomes("000#0205")], "301/7.2.8.3.1/1"),
    fault(
        "SDO is not ready behind the boot-up message",
        &[heard("605#*").after(&["000#8105", "000#8105"]).until("605#*")],
        "9.2 10.1 301/7.3.2.2.2/7",
    ),
    fault("an RPDO of one byte is taken", &[heard("205#01").becomes("205#0101")], "301/7.2.2.1/1"),
    fault(
        "the heartbeat is two percent too fast",
        &[
            sent("705#7F").when(PreOperational).after(&["605#2B17100064*"]).until("605#2B17100000*"),
            every_ms(98, "705#7F").when(PreOperational).after(&["605#2B17100064*"]).until("605#2B17100000*"),
        ],
        "301/7.2.8.3.2.2/6",
    ),
    // Blocks.
    fault(
        "a block of one segment has more",
        &[heard("605#A008100001*").becomes("605#A00810007F*")],
        "301/7.2.4.3.14/4",
    ),
    fault(
        "a block that lacks its first segment is confirmed",
        &[sent("585#A200*").becomes("585#A202*").after(&["605#C6002003*"])],
        "301/7.2.4.3.10/1",
    ),
    fault(
        "segment 2 is taken for the first one",
        &[sent("585#A200*").becomes("585#A202*").after(&["605#C2171000*"])],
        "301/7.2.4.3.9/3",
    ),
    // Transmission types.
    fault(
        "transmission type 17 is refused with the wrong abort code",
        &[heard("605#2F00180211*").is_answered("585#8000180222000008")],
        "301/7.5.2.37/3",
    ),
    fault(
        "transmission type 245 is taken",
        &[heard("605#2F001802F5*").is_answered("585#6000180200000000")],
        "301/7.5.2.37/4",
    ),
    fault("no TPDO comes with the 240th SYNC", &[sent("185#*").after(&["605#2F001802F0*"])], "301/7.2.2.2/4"),
    fault(
        "a remote frame does not ask for what SYNC has sampled",
        &[heard("185#R*").after(&["605#2F001802FC*"])],
        "301/7.2.2.3/4 301/7.2.2.3/7",
    ),
    fault(
        "type 252: what is answered is not from the last SYNC",
        &[sent("185#*").becomes("185#FFFF").after(&["605#2F001802FC*", "185#R*", "185#R*"])],
        "301/7.2.2.3/7",
    ),
    fault(
        "type 252: only the first SYNC samples",
        &[heard("080#").after(&["605#2F001802FC*", "080#"])],
        "301/7.2.2.3/7",
    ),
    fault(
        "with type 255, the event timer takes twice its time",
        &[sent("185#*").comes_half_as_often().after(&["605#2F001802FF*", "605#2B00180564*"])],
        "301/7.2.2.3/5",
    ),
    fault(
        "the event timer is not switched off",
        &[heard("605#2B0018050000*").is_answered("585#6000180500000000").after(&["605#2B00180532*"])],
        "301/7.5.2.37/5",
    ),
    fault("the inhibit time is zero", &[heard("605#2B001803E8*").becomes("605#2B00180300*")], "301/7.5.2.37/6"),
    fault(
        "the inhibit time changes while the PDO exists",
        &[heard("605#2B00180364*").is_answered("585#6000180300000000")],
        "301/7.5.2.37/7",
    ),
    fault(
        "the identifier changes while the PDO exists",
        &[heard("605#2300180184010000").is_answered("585#6000180100000000")],
        "301/7.5.2.37/8",
    ),
    fault("a synchronous RPDO acts at once", &[heard("605#2F00140201*").becomes("605#2F001402FE*")], "301/7.2.2.2/5"),
    // RPDOs and SYNCs of a wrong length, or too late.
    fault("of a long RPDO other bytes are taken", &[heard("205#......").becomes("205#000000")], "301/7.2.2.1/3"),
    fault("a long RPDO is not reported", &[sent("085#2082*")], "301/7.2.2.1/4"),
    fault(
        "an RPDO in time is reported as late",
        &[heard("205#*").brings(LATE).after(DEADLINE).until(NO_DEADLINE)],
        "301/7.5.2.35/2 301/7.5.2.35/3",
    ),
    fault(
        "an RPDO is late before the first one",
        &[every_ms(200, LATE).when(Operational).after(DEADLINE).until("205#*")],
        "301/7.5.2.35/2",
    ),
    fault("an RPDO that is late is not reported", &[sent("085#5082*")], "301/7.5.2.35/3"),
    fault(
        "the event timer of an RPDO is not switched off",
        &[heard(NO_DEADLINE).is_answered("585#6000140500000000").after(DEADLINE)],
        "301/7.5.2.35/4",
    ),
    fault("a SYNC with a counter is not reported", &[sent("085#4082*")], "301/7.2.5/3"),
    fault(
        "STOPPED: an emergency is sent",
        &[every_ms(100, "085#3081110000000000").when(Stopped).after(&["605#23161001*"])],
        "301/7.3.2.2.4/7",
    ),
    // More of the dictionary, of storing and of emergencies.
    fault(
        "1009h does not exist with the wrong abort code",
        &[heard("605#40091000*").is_answered("585#8009100011000906")],
        "306-1/6.5.2/10",
    ),
    fault("1009h exists", &[heard("605#40091000*").is_answered("585#4309100031000000")], "306-1/6.5.2/11"),
    fault(
        "five bytes begin to be written to 1006h",
        &[heard("605#210610000*").is_answered("585#6006100000000000")],
        "301/7.2.4.3.17/11",
    ),
    fault(
        "1015h is not restored",
        &[heard("605#40151000*").is_answered("585#4B15100064000000").after(&["605#23111001*"])],
        "301/7.5.2.14/5",
    ),
    fault(
        "1015h lasts over a reset",
        &[heard("605#40151000*")
            .is_answered("585#4B15100064000000")
            .after(&["605#2B151000*", "000#8105"])
            .until("605#23101001*")],
        "301/7.3.2.2.1/2",
    ),
    fault("1003h is not cleared", &[heard("605#2F03100000*").is_answered("585#6003100000000000")], "301/7.5.2.4/3"),
    fault(
        "an emergency is sent although 1014h has none",
        &[heard("605#2314100085000080").is_answered("585#6014100000000000")],
        "301/7.5.2.17/2",
    ),
    fault(
        "1003h has no entry of the emergency",
        &[sent("585#4F031000*").becomes("585#4F03100000000000")],
        "5.6 301/7.5.2.4/3",
    ),
    fault("1003h:00 takes 255", &[heard("605#2F031000FF*").is_answered("585#6003100000000000")], "301/7.5.2.4/3"),
    fault(
        "1008h, which is const, is written",
        &[heard("605#23081000*").is_answered("585#6008100000000000")],
        "4.3 4.7",
    ),
    fault(
        "emergencies take an identifier of SDO",
        &[heard("605#2314100081050000").is_answered("585#6014100000000000")],
        "8.10",
    ),
    fault(
        "the inhibit time of emergencies is zero",
        &[heard("605#2B151000B80B*").becomes("605#2B1510000000*")],
        "301/7.5.2.18/1",
    ),
    // What is recommended.
    fault("a short RPDO is not reported", &[sent("085#1082*")], "301/7.2.2.1/2"),
    fault(
        "writing 1000h is a general error",
        &[heard("605#23001000*").is_answered("585#8000100000000008")],
        "301/7.2.4.3.17/12",
    ),
    fault(
        "the event timer is two percent too fast",
        &[
            sent("185#*").when(Operational).after(&["605#2B00180532*"]),
            every_ms(49, "185#3412").when(Operational).after(&["605#2B00180532*"]).until("605#2B00180500*"),
        ],
        "301/7.2.2.3/6",
    ),
    fault(
        "SYNC is two percent too slow",
        &[heard("605#2306100010270000").becomes("605#23061000D8270000").after(&["605#40051000*", "605#40061000*"])],
        "301/7.2.5/2",
    ),
    // What faults drawn by chance have shown.
    fault(
        "an object that does not exist is received",
        &[heard("605#2300160108000620").is_answered("585#6000160100000000")],
        "301/7.5.2.36/5",
    ),
    fault(
        "an object that does not exist is transmitted",
        &[heard("605#23001A0108000620").is_answered("585#60001A0100000000")],
        "301/7.5.2.38/10",
    ),
    fault(
        "the SYNC start value changes while the PDO exists",
        &[heard("605#2F00180605*").is_answered("585#6000180600000000").after(&["605#2F00180201*"])],
        "301/7.5.2.37/9",
    ),
    fault(
        "the identifier of an RPDO changes while it exists",
        &[heard("605#2300140104020000").is_answered("585#6000140100000000")],
        "301/7.5.2.35/5",
    ),
    fault("RPDO 2 is not taken", &[heard("305#*")], "301/7.2.2.1/5"),
    fault("TPDO 3 has another value than its object", &[sent("385#*").with_other_bits(0, 1)], "301/7.2.2.1/6"),
    fault(
        "STOPPED: a guarding request is answered twice",
        &[heard("705#R*").brings("705#84").when(Stopped)],
        "301/7.2.8.3.2.1/5",
    ),
    fault(
        "OPERATIONAL: a heartbeat that came in PRE-OPERATIONAL comes half as often",
        &[sent("705#05").comes_half_as_often().after(&["705#7F"])],
        "301/7.2.8.3.2.2/7",
    ),
    fault("no emergency says that an error is over", &[sent("085#0000*")], "301/7.5.2.2/3"),
    fault(
        "OPERATIONAL: an emergency is too short",
        &[sent("085#3081*").when(Operational).lacks_its_last_byte()],
        "301/7.2.7/2",
    ),
    fault(
        "the emergency of a short RPDO has another error register than 1001h",
        &[sent("085#1082*").with_other_bits(2, 0x80)],
        "301/7.5.2.2/3",
    ),
    fault(
        "OPERATIONAL: 1008h is another text",
        &[sent("585#00*").with_other_bits(1, 1).when(Operational)],
        "306-1/6.5.2/12",
    ),
    fault("a reserved byte of SDO is not 0", &[sent("585#60171000*").with_other_bits(7, 1)], "301/7.2.4.3/6"),
    fault(
        "SYNC is late every second time",
        &[sent("080#*").every_second_comes_late(4)],
        "6.2 301/7.2.5/2 6.6 6.7 6.10",
    ),
];

/// The cases of emergencies.
pub fn tests_without_stimulus(case: &&Case) -> bool {
    ["5", "301/7.5.2.4", "301/7.5.2.17", "301/7.5.2.18", "301/7.2.2.1"].iter().any(|name| case.is_meant_by(name))
}

pub const WITHOUT_STIMULUS: &[Fault] = &[
    fault(
        "without stimulus: 1003h has no entry of the emergency",
        &[sent("585#4F031000*").becomes("585#4F03100000000000")],
        "5.6 301/7.5.2.4/3",
    ),
    fault(
        "without stimulus: 1003h is not cleared",
        &[heard("605#2F03100000*").is_answered("585#6003100000000000")],
        "301/7.5.2.4/3",
    ),
    fault(
        "without stimulus: the inhibit time of emergencies is zero",
        &[heard("605#2B151000*").becomes("605#2B1510000000*")],
        "301/7.5.2.18/1",
    ),
    fault("without stimulus: a short RPDO is not reported", &[sent("085#1082*")], "301/7.2.2.1/2"),
    fault(
        "without stimulus: an emergency is sent twice",
        &[sent("085#1082*").brings("085#*")],
        "5.4 5.5 5.6 301/7.5.2.4/3 301/7.5.2.17/2 301/7.5.2.18/1 301/7.2.2.1/2",
    ),
    fault(
        "without stimulus: an emergency is sent although 1014h has none",
        &[heard("605#2314100085000080").is_answered("585#6014100000000000")],
        "301/7.5.2.17/2",
    ),
];
