export default {
  yes: 'ja', no: 'nein', unknown: 'unbekannt', loading: 'Wird gelesen …', working: 'Läuft …', close: 'Schließen', search: 'Suchen', export: 'Exportieren',
  node: 'Knoten', tabs: 'Ansichten', jobs: 'Aufträge', 'per-second': '{count}/s',

  'tab.nodes': 'Knoten', 'tab.objects': 'Objekte', 'tab.pdos': 'PDOs', 'tab.trace': 'Trace', 'tab.plots': 'Kurven',
  'tab.drives': 'Antriebe', 'tab.bus': 'Bus', 'tab.devices': 'Simulation', 'tab.badge': '{count} mit Befund',

  'connection.connecting': 'verbindet', 'connection.open': 'verbunden', 'connection.lost': 'keine Verbindung', 'connection.ended': 'beendet', 'connection.refused': 'abgewiesen',
  faces: '{count} Seiten offen', 'faces.one': 'nur diese Seite',
  lost: 'Die Verbindung zur Bench ist abgebrochen.', 'lost.what': 'Die Anzeige ist veraltet, und von hier lässt sich nichts anhalten; die Bench hält an, was diese Seite gestartet hat. Die Seite verbindet sich selbst wieder.',
  ended: 'Die Bench wurde beendet.', 'ended.what': 'Die Anzeige ist veraltet, und von hier lässt sich nichts anhalten. `lexican bench` neu starten und die ausgegebene Adresse öffnen.',
  forbidden: 'Die Bench kennt diese Seite nicht.', 'forbidden.what': 'Die Adresse öffnen, die `lexican bench` ausgegeben hat, mit ihrem Token: Jeder Lauf hat ein eigenes.',
  'refused.lost': 'Die Verbindung zur Bench ist abgebrochen.',

  'hands.mine': 'Bedienung hier', 'hands.free': 'Nur Ansicht', 'hands.theirs': 'Seite {holder} bedient',
  'hands.take': 'Bedienen', 'hands.release': 'Abgeben', 'hands.force': 'Übernehmen',
  'hands.force.help': 'Nimmt der anderen Seite die Bedienung; was sie gestartet hat, wird angehalten',
  'hands.first': 'Erst „Bedienen“ drücken: Nur eine Seite auf einmal darf etwas verändern.',
  'hands.read-only': 'Ein aufgezeichnetes Log oder ein Bus, an dem nur mitgehört wird: Nichts lässt sich verändern.',
  'hands.lost': 'Keine Verbindung zur Bench.',

  'stop.sent': 'hält an …', 'stop.answered': 'alle Antriebe stehen, nach {ms} ms', 'stop.unanswered': 'NOCH NICHT BESTÄTIGT: Wenn sich etwas bewegt, Not-Halt der Maschine betätigen',
  'stop.refused': 'FEHLGESCHLAGEN: {why}', 'stop.unsent': 'KEINE VERBINDUNG: Not-Halt der Maschine betätigen',

  'language.switch': 'English', 'theme.switch': 'Hell, dunkel oder wie das System',
  'theme.system': 'Auto', 'theme.light': 'Hell', 'theme.dark': 'Dunkel',

  'help.title': 'Tasten', 'help.stop': 'STOP hält jeden Antrieb über seinen Treiber an. Es ist kein Not-Halt: Rechner, Bus und Antrieb müssen dafür arbeiten.',
  'keys.stop': 'STOP: hält jeden Antrieb an, von überall auf der Seite', 'keys.tabs': 'Die Ansichten der Reihe nach', 'keys.search': 'In der Ansicht suchen',
  'keys.hands': 'Bedienung übernehmen, abgeben', 'keys.help': 'Diese Liste', 'keys.rows': 'Von Zeile zu Zeile, zur ersten, zur letzten', 'keys.tree': 'Auf- und zuklappen',
  'keys.hold': 'Trace: anhalten und folgen', 'keys.pages': 'Seitenweise', 'keys.move': 'PDO: gemapptes Objekt verschieben',
  'keys.remove': 'PDO: gemapptes Objekt entfernen', 'keys.plot': 'Kurven: zoomen, verschieben, wieder folgen',

  log: 'Aufgezeichnetes Log', 'log.play': 'Abspielen', 'log.hold': 'Anhalten', 'log.position': 'Zeit', 'log.speed': 'Tempo',

  'nodes.title': 'Knoten ({count})', 'nodes.none': 'Noch kein Knoten hat sich gemeldet. „Suchen“ fragt nach ihnen.', 'nodes.scan': 'Suchen',
  'nmt.all': 'Netzwerkmanagement, alle Knoten', 'nmt.node': 'Netzwerkmanagement, Knoten {node}',
  'nmt.start': 'Start', 'nmt.start.help': 'Nach OPERATIONAL', 'nmt.stop': 'Stopp', 'nmt.stop.help': 'Nach STOPPED',
  'nmt.pre-operational': 'Pre-Op', 'nmt.pre-operational.help': 'Nach PRE-OPERATIONAL',
  'nmt.reset-node': 'Reset', 'nmt.reset-node.help': 'Knoten zurücksetzen', 'nmt.reset-communication': 'Reset Komm.', 'nmt.reset-communication.help': 'Kommunikation zurücksetzen',
  'node.id': 'ID', 'node.name': 'Name', 'node.state': 'Zustand', 'node.faults': 'Störungen', 'node.heartbeat': 'Heartbeat', 'node.sdo': 'SDO-Zeit',
  'node.aborts': 'Abbrüche', 'node.sheet': 'Gerätebeschreibung', 'node.sheet.set': 'Verwenden', 'node.silent': 'seit {seconds} s still',
  'node.vendor': 'Hersteller', 'node.product': 'Produkt', 'node.revision': 'Revision', 'node.serial': 'Seriennummer', 'node.boots': 'Boot-ups',
  'node.no-faults': 'Keine Störung.', 'node.history': 'Frühere Störungen', 'node.changes': 'Seit dem Öffnen der Bench geändert', 'node.no-changes': 'Nichts.',
  'lss.title': 'LSS', 'lss.help': 'Sucht ein Gerät ohne Node-ID (Fastscan) und gibt ihm diese.', 'lss.assign': 'Suchen und zuweisen', 'lss.taken': 'Knoten {id} gibt es schon.',

  'objects.title': 'Objektverzeichnis', 'objects.search': 'Index, Name, Gruppe', 'objects.none': 'Kein Objekt passt.',
  'objects.read-shown': 'Angezeigte lesen', 'objects.read-shown.help': 'Liest alle aufgelisteten Objekte',
  'entry.title': 'Objekt', 'entry.none': 'Ein Objekt wählen.', 'entry.address': 'Index', 'entry.name': 'Name', 'entry.value': 'Wert', 'entry.access': 'Zugriff',
  'entry.type': 'Datentyp', 'entry.default': 'Vorgabe', 'entry.limits': 'Grenzwerte', 'entry.unit': 'Einheit', 'entry.raw': 'Auf dem Bus', 'entry.group': 'Gruppe',
  'entry.read': 'Lesen', 'entry.record': 'Record lesen', 'entry.record.help': 'Liest alle Einträge dieses Objekts', 'entry.watch': 'Beobachten', 'entry.unwatch': 'Nicht mehr beobachten',
  'entry.plot': 'Kurve', 'entry.unread': 'noch nicht gelesen', 'entry.new': 'Neuer Wert', 'entry.write': 'Schreiben', 'entry.written': 'Geschrieben.', 'entry.use-default': 'Vorgabe übernehmen',
  'entry.force': 'Trotzdem senden', 'entry.force.help': 'Sendet, was die Gerätebeschreibung nicht erlaubt; das Gerät kann es noch ablehnen',
  'mappable.tpdo': 'mappbar in TPDOs', 'mappable.rpdo': 'mappbar in RPDOs', 'mappable.both': 'mappbar',
  'watch.title': 'Beobachtete Werte', 'watch.none': 'Nichts wird beobachtet.', 'watch.bounds': 'Bereich', 'watch.changes': 'Änderungen', 'watch.every': 'alle {ms} ms gelesen',
  'parameters.title': 'Alle Parameter', backup: 'Sichern', restore: 'Zurückspielen', 'restore.help': 'Schreibt, was von der DCF abweicht', dcf: 'DCF',
  'compare.defaults': 'Mit Vorgaben vergleichen', 'compare.node': 'Mit Knoten vergleichen', 'compare.dcf': 'Vergleichen', 'compare.same': 'Kein Unterschied.', 'compare.here': 'Im Knoten', 'compare.there': 'Dort',

  'pdos.title': 'PDOs', 'pdos.read': 'Neu lesen', 'pdos.none': 'Dieser Knoten hat keine PDOs.', 'pdos.receive': 'Empfangs-PDOs: zum Knoten', 'pdos.transmit': 'Sende-PDOs: vom Knoten',
  'pdo.on': 'ein', 'pdo.off': 'aus', 'pdo.timer': 'Event-Timer {ms} ms', 'pdo.inhibit': 'Inhibit-Zeit {ms} ms', 'pdo.bits': '{used} von {all} Bit', 'pdo.edit': 'Mapping ändern', 'pdo.empty': 'leer',
  'bits.byte': 'Byte {byte}', 'bits.bytes': 'Bytes {byte}–{last}', 'bits.bit': 'Byte {byte}, Bit {bit}', 'bits.range': 'Byte {byte}, Bit {bit} – Byte {last}, Bit {lastBit}', 'bits.count': '{bits} Bit',
  'map.mappable': 'Mappbare Objekte', 'map.add': 'Hinzufügen', 'map.present': 'Gemappte Objekte', 'map.empty': 'Objekte hierher ziehen oder mit Enter hinzufügen.', 'map.help': 'Ziehen, oder Alt+Pfeil verschiebt, Entf entfernt.',
  'map.earlier': 'Nach vorn', 'map.later': 'Nach hinten', 'map.remove': 'Entfernen', 'map.checking': 'Wird geprüft …', 'map.fine': 'Nichts spricht dagegen.', 'map.transmission': 'Übertragungsart', 'map.apply': 'Anwenden', 'map.revert': 'Verwerfen',

  'trace.title': 'Trace', 'trace.kept': '{kept} von {all} behalten', 'trace.follow': 'Folgen', 'trace.format': 'Format', 'trace.jump': 'Zu diesem Frame im Trace',
  'trace.number': 'Nr.', 'trace.time': 'Zeit', 'trace.id': 'COB-ID', 'trace.service': 'Dienst', 'trace.data': 'Daten', 'trace.text': 'Bedeutung',
  'trace.following': 'Folgt: {count} Zeilen passen.', 'trace.held': 'Angehalten: {count} Zeilen passen. Ende oder „Folgen“ geht weiter.',
  filter: 'Filter', 'filter.text': 'Text', 'filter.nodes': 'Knoten', 'filter.object': 'Objekt', 'filter.ids': 'COB-IDs', 'filter.without': 'Ohne', 'filter.services': 'Dienste',
  'filter.alarming': 'Nur Fehler', 'filter.transfers': 'SDO-Transfers falten', 'filter.clear': 'Leeren',
  'filter.text.example': '', 'filter.nodes.example': '3,5-9', 'filter.object.example': '6041', 'filter.ids.example': '180-1FF', 'filter.without.example': 'sync,heartbeat',

  'plots.title': 'Kurven', 'plots.none': 'Noch keine Kurve: Knoten und Signale wählen.', 'plots.span': 'Im Blick', 'plots.follow': 'Folgen', 'plots.clear': 'Alle entfernen',
  'plots.signals': 'Objekte, PDOs', 'plots.every': 'Alle', 'plots.add': 'Hinzufügen', 'plots.curve': 'Kurve', 'plots.now': 'Jetzt', 'plots.low': 'Kleinster', 'plots.high': 'Größter', 'plots.increments': 'Ink.',
  trigger: 'Trigger', 'trigger.edge': 'Flanke', 'trigger.rising': 'steigend', 'trigger.falling': 'fallend', 'trigger.level': 'Pegel', 'trigger.arm': 'Scharf schalten', 'trigger.armed': 'Scharf …',

  'drives.none': 'Kein Knoten ist ein Antrieb.', 'drive.machine': 'Zustandsmaschine nach CiA 402; jetzt: {state}', 'drive.to-state': 'Nach {state}',
  'drive.position': 'Position', 'drive.velocity': 'Geschwindigkeit', 'drive.target': 'Ziel', 'drive.mode': 'Betriebsart', 'drive.ready': 'Bereit für Fahraufträge.', 'drive.obstacles': 'Würde ablehnen, denn',
  'drive.value': 'Position, Weg oder Geschwindigkeit', 'drive.method': 'Referenzfahrt-Methode', 'drive.may-be-moving': 'Er bewegt sich vielleicht noch: Er ließ sich nicht anhalten.',
  'order.enable': 'Freigeben', 'order.enable.help': 'Nach OPERATION ENABLED', 'order.disable': 'Sperren', 'order.disable.help': 'Nach SWITCH ON DISABLED',
  'order.reset-fault': 'Störung quittieren', 'order.reset-fault.help': 'FAULT verlassen', 'order.move-to': 'Fahren nach', 'order.move-to.help': 'Zur Position fahren',
  'order.step': 'Fahren um', 'order.step.help': 'Um den Weg fahren', 'order.run': 'Drehen', 'order.run.help': 'Mit der Geschwindigkeit, bis zum Anhalten',
  'order.home': 'Referenzfahrt', 'order.home.help': 'Sucht die Referenz', 'order.stop': 'Anhalten', 'order.stop.help': 'Mit der eingestellten Verzögerung', 'order.quick-stop': 'Schnellhalt', 'order.quick-stop.help': 'Mit voller Verzögerung',

  'bus.title': 'Bus', 'bus.load': 'Buslast', 'bus.state': 'Zustand', 'bus.bit-rate': 'Bitrate', 'bus.peak': 'Spitzenlast', 'bus.rate': 'Frames', 'bus.frames': 'Frames insgesamt', 'bus.missing': 'Verlorene Frames',
  'bus.writable': 'Kann gesendet werden', 'bus.troubles': 'Was nicht stimmt', 'bus.no-troubles': 'Alles in Ordnung.', 'bus.sdo': 'SDO-Antwortzeiten', 'bus.aborts': '{count} Abbrüche', 'bus.ids': 'COB-IDs ({count})',
  'ids.id': 'COB-ID', 'ids.name': 'Dienst', 'ids.node': 'Knoten', 'ids.per_second': 'Pro Sekunde', 'ids.share_percent': 'Anteil am Bus', 'ids.jitter_ms': 'Jitter', 'ids.frames': 'Frames',

  'devices.none': 'Hier gibt es keine simulierten Geräte: `lexican bench --demo` hat welche.', 'device.on': 'versorgt', 'device.off': 'ohne Spannung', 'device.cut': 'Spannung abschalten', 'device.supply': 'Einschalten', 'device.set': 'Setzen', 'device.no-inputs': 'Es hat keine Eingänge.',
}
